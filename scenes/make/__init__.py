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

`python -m scenes.make scenes` writes what the scenes use; `snake`, `piece` and
`disc` write one's own.
"""

from mitsuba_diffraction.scene.orientation.directions import DirectionField, direction_field
from mitsuba_diffraction.scene.orientation.oriented import oriented_mesh
from mitsuba_diffraction.scene.orientation.tangents import (
    TangentReport,
    check_tangents,
    load_mesh,
    load_orientation,
)
from mitsuba_diffraction.scene.orientation.trimesh import TriangleMesh, write_ply

from .anatomy import Anatomy
from .disc import disc
from .knot import knot
from .piece import piece
from .scales import Scales
from .snake import Snake, build

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
