"""Surfaces in Blender's Cycles, by shaders in Open Shading Language (OSL).

Contents
--------
export    write a shader with its textures, and a script that adds the material to a .blend file
shaders/  sources in OSL
"""

from __future__ import annotations

from .export import Exported, export

__all__ = ["Exported", "export"]
