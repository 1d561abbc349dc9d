"""Arrays of Mitsuba's meshes.

The names and shapes of the arrays differ between Mitsuba 3.9 and 3.10. Up to 3.9 a mesh has flat
buffers with an entry for each vertex. From 3.10 on it has tensors, and vertices may share positions
and normals, which they then name by index.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..arrays import Real, Whole


class MeshArrays(NamedTuple):
    """Arrays of a triangle mesh.

    Attributes
    ----------
    positions, normals : (n, 3); normals may be absent.
    uv : (n, 2) texture coordinates, or None.
    faces : (m, 3) indices of vertices.
    materials : (m,) number of each triangle's material in a glTF file, or None.
    """

    positions: Real
    normals: Real | None
    uv: Real | None
    faces: Whole
    materials: Whole | None = None


def mesh_arrays(mesh: Any) -> MeshArrays:
    """Read the arrays of a `mi.Mesh`, with one row for each vertex or face.

    Normals and texture coordinates are None where the mesh has none.
    """
    normals = uv = None
    if _call(mesh, "has_vertex_normals", "has_normals"):
        values = _call(mesh, "vertex_normals_buffer", "normals")
        normals = _of_vertices(values, 3, mesh, "normal_index")
    if has_texcoords(mesh):
        values = _call(mesh, "vertex_texcoords_buffer", "texcoords")
        uv = np.array(values, np.float64).reshape(-1, 2)
    values = _call(mesh, "vertex_positions_buffer", "positions")
    positions = _of_vertices(values, 3, mesh, "position_index")
    faces = np.array(_call(mesh, "faces_buffer", "faces"), np.int64).reshape(-1, 3)
    return MeshArrays(positions, normals, uv, faces)


def has_texcoords(mesh: Any) -> bool:
    """Return whether the vertices of a `mi.Mesh` have texture coordinates."""
    return bool(np.all(_call(mesh, "has_vertex_texcoords", "has_texcoords")))


def _call(mesh: Any, before: str, since: str) -> Any:
    """Call a method by its name before Mitsuba 3.10, or since."""
    return getattr(mesh, before if hasattr(mesh, before) else since)()


def _of_vertices(values: Any, width: int, mesh: Any, index: str) -> Real:
    """Return a row for each vertex; an empty index map stands for the rows as they are."""
    rows = np.array(values, np.float64).reshape(-1, width)
    rows_of = np.array(getattr(mesh, index)(), np.int64) if hasattr(mesh, index) else np.array([])
    return rows[rows_of] if rows_of.size else rows
