"""Scenes rendered in real time, and their differences from the path tracer.

Contents
--------
glsl               shaders, and a renderer that uses them
web                pages for a browser
shader_comparison  comparison of the shaders with the path tracer
"""
