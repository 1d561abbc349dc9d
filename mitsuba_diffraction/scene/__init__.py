"""Scenes: loading, rendering in passes, planning, and meshes that a patch can follow.

Contents
--------
load         variants set and scenes loaded
mitsuba_errors  Mitsuba's errors in one line
elements     names of elements, surfaces in their BSDFs, what a shape has to have
nodes        checks of a parsed scene, before Mitsuba reads its files
parameters   names that may be set, and values that change from frame to frame
passes       rendering in passes of samples
pictures     EXR and PNG of pictures
denoise      pictures without noise, by Open Image Denoise
frames       frames of an animation, and a film of them
additions    meshes, lights and filters changed before Mitsuba makes a scene's objects
surfaces     surfaces and their parameters put into a scene
clamping     integrator that limits the light of single samples
bands        films with a band for each receptor of an eye, and tables that cover it
mesh_materials  materials of glTF files, each a shape
fitted_mesh  mesh files put on a stage: upright, centred, standing on the floor
hologram     textures of dot-matrix holograms from pictures
logo         areas of colour of a picture, and the gratings that show them
label        scenes of a logo's hologram, on a card or a mesh
orbit        cameras that go around what diffracts
stage        the studio for meshes without a scene
planning     the recipes of tables that suffice for a scene
orientation  directions that a patch follows over a mesh
"""

from .load import load_scene, set_variant
from .passes import Stop, render_passes
from .pictures import read_exr

__all__ = [
    "Stop", "additions", "bands", "denoise", "elements", "fitted_mesh", "frames", "hologram",
    "label", "load", "load_scene", "logo", "orbit", "parameters", "passes",
    "pictures", "read_exr", "render_passes", "set_variant", "stage", "surfaces",
]  # fmt: skip
