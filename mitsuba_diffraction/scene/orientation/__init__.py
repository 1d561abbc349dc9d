"""Meshes that a measured patch can follow.

Contents
--------
trimesh      `TriangleMesh`, `write_ply`
tangents     whether a mesh has the tangents that a patch needs
breaks       along how long lines a field of directions breaks
directions   `direction_field`: a smooth field of directions on any mesh
oriented     `oriented_mesh`: a mesh whose patch follows such a field
"""

from __future__ import annotations

from .directions import DirectionField, direction_field
from .oriented import oriented_mesh
from .tangents import TangentReport, check_tangents, load_mesh, load_orientation
from .trimesh import TriangleMesh, write_ply

__all__ = [
    "DirectionField",
    "TangentReport",
    "TriangleMesh",
    "check_tangents",
    "direction_field",
    "load_mesh",
    "load_orientation",
    "oriented_mesh",
    "write_ply",
]
