"""The realtime port in GLSL: shaders, what they read, and a renderer (extra `gl`).

Contents
--------
Renderer     draws a scene of Mitsuba by shaders, without a window (in `renderer`)
export_shader  writes a surface's shader for other programs (in `export`)
scene        a scene as the shaders know it: triangles and their tangents, and the next three
materials    BSDFs, and what plain ones mirror
maps         their textures
lights       directions, points, spots, a smooth sky
emitters     all emitters as a sequence of lights
shadows      shadow maps, and what casts shadows
surroundings  what lobes meet: environments, flat lights, what stands in the way; the lobes
progressive  frames with one light each, or what lobes meet, accumulated
camera       sensors; the camera and the light, moved by hand
packing      tables as textures
texels       textures, uniforms and definitions that a shader reads; numbers packed in texels
methods      a method's tables and programs; the methods of the thesis as textures
source       the shaders' text, also without what a surface lacks, under names of its own
context      OpenGL without a window: programs, textures, pictures to draw into
timing       how long fragments take
viewer       a window on a scene with its panel (extra `view`)
"""

from __future__ import annotations

from .export import export_shader
from .renderer import Renderer

__all__ = ["Renderer", "export_shader"]
