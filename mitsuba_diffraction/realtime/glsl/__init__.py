"""The realtime port in GLSL: shaders, what they read, and a renderer (extra `gl`).

Contents
--------
Renderer     draws a scene of Mitsuba by shaders, without a window (in `renderer`)
export_shader  writes a surface's shader for other programs (in `export`)
scene        a scene as the shaders know it, made of the next six
shapes       triangles and their tangents
materials    BSDFs
maps         their textures
gloss        what plain BSDFs mirror
lights       directions, points, spots, a smooth sky
emitters     all emitters as a sequence of lights
shadows      shadow maps
casters      what casts shadows
surroundings  what comes from a direction: environments, flat lights, what stands in the way
obstacles    how far it is to the nearest surface, on a grid
lobes        directions that a surface sends light to
stage        what progressive light needs of a scene from wherever it is seen
progressive  frames with one light each, or what lobes meet, accumulated
camera       sensors
packing      tables as textures
thesis       the methods of the thesis as textures
texels       textures, uniforms and definitions that a shader reads; numbers packed in texels
source       the shaders' text
context      OpenGL without a window: programs, textures, pictures to draw into
prepared     a method's tables and programs
preprocess   shader text without what a surface lacks, under names of its own
timing       how long fragments take
viewer       a window on a scene (extra `view`)
panel        its panel
navigation   the camera and the light, moved by hand
"""

from __future__ import annotations

from .export import export_shader
from .renderer import Renderer

__all__ = ["Renderer", "export_shader"]
