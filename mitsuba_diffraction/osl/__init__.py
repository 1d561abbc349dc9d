"""Surfaces in Blender's Cycles, by shaders in Open Shading Language (OSL).

Contents
--------
export            write a shader with its textures and the script into a folder
solved            constants of a table of solved orders, and the error of its texture
patch             textures and constants of a patch of heights
formulas          formulas of optics that the shaders call, as functions in OSL
spectrum          wavelengths that a shader draws, and their colours
sockets           inputs of the shaders, with names and tooltips
addon             zip of exported surfaces that Blender installs
blender_addon     the add-on's own code, which runs in Blender
blender_material  script that runs in Blender and adds the material to a file

Sources in OSL are in the folder shaders.
"""

from __future__ import annotations

from .addon import make_addon
from .export import Exported, check_name, export

__all__ = ["Exported", "check_name", "export", "make_addon"]
