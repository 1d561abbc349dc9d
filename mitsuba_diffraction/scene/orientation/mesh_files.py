"""Mesh files: Mitsuba reads most, and PLY files of polygons after they are cut into triangles."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...arrays import Whole
from ...atomic import atomic_path
from ...errors import DiffractionError, one_line, warn
from ...files import GLTF, MESHES, USD, readable_file
from ..elements import ORIENTATION
from ..meshes import mesh_arrays
from ..mitsuba_errors import reason_of
from .interchange import fans, interchange_mesh
from .mesh_indices import FORMATS, check_mesh, ply_header, rests_of_lines
from .trimesh import TriangleMesh, vertex_normals

# Errors of reading: Mitsuba's own, of text that is not UTF-8, of sizes beyond the memory
_UNREAD = (RuntimeError, ValueError, MemoryError)

_NAMED = 4  # materials that a line lists

KINDS = {".ply": "ply", ".obj": "obj", ".serialized": "serialized"}


class MeshFile(NamedTuple):
    """Contents of a mesh file.

    Attributes
    ----------
    file : the file.
    mesh : the triangles, with the vertices that they name; its orientation is the attribute
        vertex_orientation.
    own_normals : whether the file holds vertex normals; otherwise `vertex_normals` has made them.
    materials : (m,) number of each triangle's material in a glTF file; None for other files.
    """

    file: Path
    mesh: TriangleMesh
    own_normals: bool
    materials: Whole | None


def read_mesh(path: str | os.PathLike[str]) -> MeshFile:
    """Read all that a mesh file holds; where it has no normals, `vertex_normals` makes smooth ones.

    Reads what Mitsuba reads, .ply, .obj, .serialized, PLY files of polygons, glTF and USD. Normals
    of an OBJ file are rebuilt, with a warning, if one has length 0.

    Raises a DiffractionError if the file cannot be read, or is not a mesh of these kinds.
    """
    file, turns = Path(path), None
    if file.suffix.lower() not in MESHES:
        raise DiffractionError(
            f"mesh '{file}': its name must end in {', '.join(MESHES)}; convert it to PLY or OBJ"
        )
    readable_file(file)
    if file.suffix.lower() in (*GLTF, *USD):
        arrays = interchange_mesh(file)
    else:
        if mi.variant() is None:
            mi.set_variant("scalar_rgb")
        loaded = _load(file)
        _warn_of_materials(file)
        if loaded.has_attribute(ORIENTATION):
            turns = np.array(loaded.attribute_buffer(ORIENTATION), dtype=np.float64)
            turns = turns.reshape(loaded.vertex_count(), -1)[:, :2]
        arrays = mesh_arrays(loaded)
        # Mitsuba's normals have seams where texture coordinates have
        arrays = arrays if _states_normals(file) else arrays._replace(normals=None)
    positions, own, uv, faces, materials = arrays
    normals = vertex_normals(positions, faces, uv) if own is None else own
    mesh = TriangleMesh(positions, normals, uv, faces, turns)
    # other vertices would count in the mesh's size
    return MeshFile(file, mesh.part(np.ones(len(faces), bool)), own is not None, materials)


def load_mesh(path: str | os.PathLike[str]) -> TriangleMesh:
    """Return the triangles of `read_mesh`."""
    return read_mesh(path).mesh


def _states_normals(file: Path) -> bool:
    """Whether a file that Mitsuba reads holds vertex normals."""
    if file.suffix.lower() == ".ply":
        header = ply_header(file, f"mesh '{file}'")
        vertex = [e for e in header.elements if e.name == "vertex"] if header else []
        return any(words[-1] == "nx" for element in vertex for words in element.properties)
    return file.suffix.lower() != ".obj" or next(rests_of_lines(file, b"vn"), None) is not None


def _warn_of_materials(file: Path) -> None:
    """Say that the materials of an OBJ file have no effect, if it has any."""
    if file.suffix.lower() != ".obj":
        return
    if names := list(dict.fromkeys(rests_of_lines(file, b"usemtl"))):
        listed = ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
        warn(
            f"mesh '{file}': materials of OBJ files are not supported ({one_line(listed)}), the "
            "mesh has one surface; export it as glTF (.glb) to give them surfaces by name"
        )


def _load(file: Path, **options: bool) -> mi.Mesh:
    kind, shown = KINDS[file.suffix.lower()], f"mesh '{file}'"
    check_mesh(file, kind)
    try:
        return mi.load_dict({"type": kind, "filename": str(file), **options})
    except _UNREAD as error:
        if kind == "obj" and "invalid vertex normal" in str(error):
            warn(f"{shown}: a vertex normal has length 0; all are rebuilt from the triangles")
            return _load(file, face_normals=True)
        triangles = None
        # damaged content: too few numbers, or impossible sizes
        with contextlib.suppress(ValueError, OverflowError, MemoryError):
            triangles = triangulated_ply(file) if kind == "ply" else None
        if triangles is not None:
            with tempfile.TemporaryDirectory() as folder:
                cut = Path(folder, file.name)
                cut.write_bytes(triangles)
                check_mesh(cut, kind, shown=shown)
                with contextlib.suppress(*_UNREAD):
                    return mi.load_dict({"type": kind, "filename": str(cut)})
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
        turn = ORIENTATION.removeprefix("vertex_")
        blocks[f"{turn}_0 {turn}_1 {turn}_2"] = np.pad(mesh.orientation, [(0, 0), (0, 1)])
    vertices = np.concatenate([*blocks.values()], axis=1).astype("<f4")
    properties = [f"float {name}" for name in " ".join(blocks).split()]
    content = _ply("<", properties, vertices, mesh.faces, comment)
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def _ply(
    order: str, properties: list[str], vertices: NDArray[Any], triangles: Whole, comment: str = ""
) -> bytes:
    """Return a binary PLY file.

    order : NumPy's code of the order of bytes.
    properties : types and names of a vertex's numbers.
    vertices : a row for each vertex.
    triangles : (m, 3) numbers of vertices.
    """
    faces = np.empty(len(triangles), [("count", "u1"), ("corners", f"{order}i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    header = [
        "ply", f"format binary_{'little' if order == '<' else 'big'}_endian 1.0",
        *(f"comment {line}" for line in comment.splitlines()),
        f"element vertex {len(vertices)}", *(f"property {each}" for each in properties),
        f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", "",
    ]  # fmt: skip
    start = "\n".join(header).encode("ascii", "replace")
    return start + vertices.tobytes() + faces.tobytes()


def triangulated_ply(file: Path) -> bytes | None:
    """Cut the polygons of a PLY file into fans of triangles, as Mitsuba cuts polygons of OBJ.

    Faces must come after vertices; the result has nothing else. None for other files.

    Raises a ValueError for a damaged file.
    """
    shown = f"mesh '{file}'"
    header = ply_header(file, shown)
    if header is None or [e.name for e in header.elements[:2]] != ["vertex", "face"]:
        return None
    (vertex, face), content = header.elements[:2], header.content(file, shown)
    if header.format not in FORMATS or any(words[0] == "list" for words in vertex.properties):
        return None
    row = header.row(vertex, 0)
    vertices, at = np.frombuffer(content, row, vertex.number), vertex.number * row.itemsize
    counts, polygons = [], []
    for _ in range(face.number):
        for words in face.properties:
            size = 1
            if words[0] == "list":
                kind = header.type_of(words[1])
                size = int(np.frombuffer(content, kind, 1, at)[0])
                at += kind.itemsize
            kind = header.type_of(words[-2])
            if size < 0:
                raise ValueError
            if words[-1] in ("vertex_indices", "vertex_index"):
                counts.append(size)
                polygons.append(np.frombuffer(content, kind, size, at))
            at += size * kind.itemsize
    corners = np.concatenate(polygons)
    if not (np.abs(corners) < float(1 << 31)).all():  # texts may have any number, or none
        raise ValueError
    text = header.format == "ascii"
    properties = [f"{'double' if text else kind} {name}" for kind, name in vertex.properties]
    return _ply(header.order, properties, vertices, corners[fans(np.array(counts))])
