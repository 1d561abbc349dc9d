"""Realtime rendering in GLSL: shaders, their textures and uniforms, and a renderer (extra `gl`).

Contents
--------
Renderer       draw a Mitsuba scene by shaders, without a window (in `renderer`)
export_shader  write the shader of a surface for other programs (in `export`)
scene          scenes as triangles with tangents, materials, lights and a camera
packed_scene   all that shaders read of a scene, for the renderer and the page
shader_materials  BSDFs, and the gloss of plain ones
diffracting    surfaces that diffract: constants, energy conservation, tables, lobes
solved         tables of solved orders: efficiencies as a texture, brightness of lobes
lobes          directions drawn from lobes, and their densities
features       features of surfaces that the shaders draw
maps           textures of materials
lights         directions, points, spots, and a smooth sky
emitters       all emitters of a scene as a sequence of lights
shadows        shadow maps, and the triangles that cast shadows
surroundings   environments, flat lights and obstacles, which lobes look up
bounces        light between surfaces on a grid
camera         sensors as cameras
packing        tables as textures
texels         textures, uniforms and definitions that a shader reads; packing of numbers
methods        tables and programs of each method, also of the thesis' methods
formulas       formulas of optics that a shader calls, as functions in GLSL
source         text of the shaders, by method and surface
rewriting      files of shaders; prefixed names for other programs
context        OpenGL without a window: programs, textures, framebuffers
timing         time per fragment
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .export import export_shader
    from .renderer import Renderer

__all__ = [
    "Renderer", "export", "export_shader", "features", "methods", "packing", "scene",
    "texels",
]  # fmt: skip


#: Names whose modules --help does without.
_LATER = {"Renderer": "renderer", "export_shader": "export"}


def __getattr__(name: str) -> Any:
    if name in _LATER:
        return getattr(importlib.import_module(f"{__name__}.{_LATER[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
