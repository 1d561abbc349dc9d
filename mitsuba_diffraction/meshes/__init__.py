"""Meshes that a measured patch can follow.

Contents
--------
snake        build a coiled snake: `build`, `Snake`
anatomy      `Anatomy`: proportions, cross-sections, conformal coordinates
scales       `Scales`: rows, relief, overlap and keels of the scales
pelt         a skin of scales, as one closed mesh
spine        how the body lies
skin         the smooth skin between spine and scales
head         shields, mouth, eyes; the tail tip
piece        `piece`: a few scales for close views
pigment      images of what lies under the skin, and of the ground
disc         `disc`: a ring whose patch follows the radius
knot         `knot`: a mesh without texture coordinates
tangents     whether a mesh has the tangents that a patch needs
breaks       along how long lines a field of directions breaks
directions   `direction_field`: a smooth field of directions on any mesh
oriented     `oriented_mesh`: a mesh whose patch follows such a field
options      the parameters as options of the command line
limits       one check for them
trimesh      `TriangleMesh`, `write_ply`

`python -m mitsuba_diffraction.meshes scenes` writes what the scenes use; `snake`, `piece` and
`disc` write one's own.
"""

from .anatomy import Anatomy
from .directions import DirectionField, direction_field
from .disc import disc
from .knot import knot
from .oriented import oriented_mesh
from .piece import piece
from .scales import Scales
from .snake import Snake, build
from .tangents import TangentReport, check_tangents, load_mesh, load_orientation
from .trimesh import TriangleMesh, write_ply

__all__ = [
    "Anatomy",
    "DirectionField",
    "Scales",
    "Snake",
    "TangentReport",
    "TriangleMesh",
    "build",
    "check_tangents",
    "direction_field",
    "disc",
    "knot",
    "load_mesh",
    "load_orientation",
    "oriented_mesh",
    "piece",
    "write_ply",
]
