"""Meshes that a measured patch can follow.

Contents
--------
snake      build a coiled snake: `build`, `Snake`
anatomy    `Anatomy`: proportions, cross-sections, conformal coordinates
scales     `Scales`: rows, relief, overlap and keels of the scales
spine      how the body lies
skin       the smooth skin between spine and scales
head       shields, mouth, eyes; the tail tip
pigment    images of what lies under the skin, and of the ground
tangents   whether a mesh has the tangents that a patch needs
trimesh    `TriangleMesh`, `write_ply`

`python -m mitsuba_diffraction.meshes scenes` writes what the scenes use, and `... snake -o X.ply` a
snake of one's own.
"""

from .anatomy import Anatomy
from .scales import Scales
from .snake import Snake, build
from .tangents import TangentReport, check_tangents, load_mesh
from .trimesh import TriangleMesh, write_ply

__all__ = [
    "Anatomy",
    "Scales",
    "Snake",
    "TangentReport",
    "TriangleMesh",
    "build",
    "check_tangents",
    "load_mesh",
    "write_ply",
]
