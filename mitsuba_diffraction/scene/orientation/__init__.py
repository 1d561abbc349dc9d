"""Meshes that a measured patch can follow.

Contents
--------
trimesh      `TriangleMesh`: arrays; `oriented_mesh`: one whose patch follows a field
mesh_files   `load_mesh`, `write_ply`; PLY files of polygons
mesh_indices  mesh files checked before Mitsuba reads them
interchange  meshes of glTF and USD files
tangents     `check_tangents`: whether a mesh has the tangents that a patch needs, where they break
directions   `direction_field`: a smooth field of directions on any mesh
"""

from __future__ import annotations

from .directions import GUIDES, DirectionField, direction_field
from .mesh_files import load_mesh, write_ply
from .tangents import TangentReport, check_tangents
from .trimesh import (
    TriangleMesh,
    cell_corners,
    grid_faces,
    oriented_mesh,
    texture_tangents,
)

__all__ = [
    "GUIDES", "DirectionField", "TangentReport", "TriangleMesh", "cell_corners",
    "check_tangents", "direction_field", "directions", "grid_faces", "load_mesh",
    "mesh_files", "oriented_mesh", "tangents", "texture_tangents", "trimesh",
    "write_ply",
]  # fmt: skip
