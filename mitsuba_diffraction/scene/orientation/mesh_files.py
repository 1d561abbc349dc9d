"""Mesh files: NumPy reads PLY, of triangles or polygons, and Mitsuba reads OBJ and serialized."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from ...arrays import Real
from ...atomic import atomic_path
from ...errors import DiffractionError, one_line, warn
from ...files import GLTF, MESHES, USD, readable_file
from ..elements import ORIENTATION
from ..mitsuba_errors import reason_of
from .interchange import interchange_mesh
from .mesh_indices import check_mesh, read_ply, rests_of_lines
from .trimesh import MeshArrays, TriangleMesh, vertex_normals

# Errors of reading: Mitsuba's own, of text that is not UTF-8, of sizes beyond the memory
_UNREAD = (RuntimeError, ValueError, MemoryError)

_NAMED = 4  # materials that a line lists
# What PLY files call the attribute
_TURN = ORIENTATION.removeprefix("vertex_")


def load_mesh(path: str | os.PathLike[str]) -> TriangleMesh:
    """Read all that a mesh file holds; where it has no normals, `vertex_normals` makes smooth ones.

    Reads what Mitsuba reads, .ply, .obj, .serialized, PLY files of polygons, glTF and USD. Normals
    of an OBJ file are rebuilt, with a warning, if one has length 0. The orientation is the
    attribute vertex_orientation.

    Raises a DiffractionError if the file cannot be read, or is not a mesh of these kinds.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in MESHES:
        raise DiffractionError(
            f"mesh '{file}': its name must end in {', '.join(MESHES)}; convert it to PLY or OBJ"
        )
    readable_file(file)
    if suffix in (*GLTF, *USD):
        arrays = interchange_mesh(file)
    elif suffix == ".ply":
        arrays = _ply_arrays(file)
    else:
        if mi.variant() is None:
            mi.set_variant("scalar_rgb")
        arrays = mesh_arrays(_load(file))
    if suffix == ".obj":
        _warn_of_materials(file)
        if next(rests_of_lines(file, b"vn"), None) is None:
            # Mitsuba's own have seams where texture coordinates have
            arrays = arrays._replace(normals=None)
    positions, own, uv, faces, turns, materials = arrays
    normals = vertex_normals(positions, faces, uv) if own is None else own
    mesh = TriangleMesh(positions, normals, uv, faces, turns, own is not None, materials)
    # vertices of no triangle would count in the mesh's size
    return mesh.part(np.ones(len(faces), bool))


def mesh_arrays(mesh: Any) -> MeshArrays:
    """Return the arrays of a `mi.Mesh`, with a row for each vertex and face.

    Mitsuba writes the mesh and NumPy reads it, since the methods for its arrays differ between
    Mitsuba 3.9 and 3.10.
    """
    with tempfile.TemporaryDirectory() as folder:
        mesh.write_ply(str(file := Path(folder, "mesh.ply")))
        return _ply_arrays(file)


def _ply_arrays(file: Path) -> MeshArrays:
    """Return the arrays of a PLY file."""
    columns, triangles = read_ply(file, f"mesh '{file}'")
    if not {"x", "y", "z"} <= {*columns}:
        raise DiffractionError(f"mesh '{file}': its vertices have no x, y and z; export it again")

    def numbers(*names: str) -> Real | None:
        if not names or not {*names} <= {*columns}:
            return None
        return np.stack([columns[name] for name in names], axis=1).astype(np.float64)

    positions = np.stack([columns[axis] for axis in "xyz"], axis=1).astype(np.float64)
    normals, uv = numbers("nx", "ny", "nz"), numbers(*("uv" if "u" in columns else "st"))
    turns = numbers(*[name for name in columns if name.startswith(f"{_TURN}_")][:2])
    return MeshArrays(positions, normals, uv, triangles.astype(np.int64), turns)


def _warn_of_materials(file: Path) -> None:
    """Say that the materials of an OBJ file have no effect, if it has any."""
    if names := list(dict.fromkeys(rests_of_lines(file, b"usemtl"))):
        listed = ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
        warn(
            f"mesh '{file}': materials of OBJ files are not supported ({one_line(listed)}), the "
            "mesh has one surface; export it as glTF (.glb) to give them surfaces by name"
        )


def _load(file: Path, **options: bool) -> mi.Mesh:
    kind, shown = file.suffix[1:].lower(), f"mesh '{file}'"
    check_mesh(file, kind)
    try:
        return mi.load_dict({"type": kind, "filename": str(file), **options})
    except _UNREAD as error:
        if kind == "obj" and "invalid vertex normal" in str(error):
            warn(f"{shown}: a vertex normal has length 0; all are rebuilt from the triangles")
            return _load(file, face_normals=True)
        raise DiffractionError(
            f"{shown}: cannot be read: {reason_of(error)}; export it again"
        ) from error


def write_ply(path: str | os.PathLike[str], mesh: TriangleMesh, comment: str = "") -> None:
    """Write a binary PLY, with the names of properties that Mitsuba writes.

    An orientation becomes the mesh attribute `vertex_orientation` with the channels (cos, sin, 0):
    Mitsuba 3.9 reads attributes of one or three channels and ignores attributes of two.

    Raises a DiffractionError if the file cannot be written.
    """
    blocks = {"x y z": mesh.positions, "nx ny nz": mesh.normals}
    if mesh.uv is not None:
        blocks["s t"] = mesh.uv
    if mesh.orientation is not None:
        blocks[f"{_TURN}_0 {_TURN}_1 {_TURN}_2"] = np.pad(mesh.orientation, [(0, 0), (0, 1)])
    vertices = np.concatenate([*blocks.values()], axis=1).astype("<f4")
    faces = np.empty(len(mesh.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    header = [
        "ply", "format binary_little_endian 1.0",
        *(f"comment {line}" for line in comment.splitlines()),
        f"element vertex {len(vertices)}",
        *(f"property float {name}" for name in " ".join(blocks).split()),
        f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", "",
    ]  # fmt: skip
    start = "\n".join(header).encode("ascii", "replace")
    with atomic_path(path) as temporary:
        temporary.write_bytes(start + vertices.tobytes() + faces.tobytes())
