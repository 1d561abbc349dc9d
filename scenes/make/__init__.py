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
options      the parameters as options of the command line
limits       one check for them

`python -m scenes.make scenes` writes what the scenes use; `snake`, `piece` and
`disc` write one's own.
"""

from .anatomy import Anatomy
from .disc import disc
from .knot import knot
from .piece import piece
from .scales import Scales
from .snake import Snake, build

__all__ = [
    "Anatomy",
    "Scales",
    "Snake",
    "build",
    "disc",
    "knot",
    "piece",
]
