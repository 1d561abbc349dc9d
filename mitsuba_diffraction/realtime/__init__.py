"""Scenes in real time, and how far they are from the path tracer's.

Contents
--------
glsl         shaders, and a renderer of them
web          pages for a browser
comparison   beside the path tracer
"""
