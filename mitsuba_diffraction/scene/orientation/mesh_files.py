"""Mesh files: Mitsuba reads most, and PLY files of polygons after they are cut into triangles."""

from __future__ import annotations

import contextlib
import os
import re
import struct
import tempfile
from pathlib import Path
from typing import NamedTuple

import mitsuba as mi
import numpy as np

from ...arrays import Real, Whole
from ...atomic import atomic_path
from ...errors import DiffractionError, warn
from ...files import GLTF, MESHES, USD, readable_file
from ..elements import ORIENTATION
from ..meshes import SmoothMesh, mesh_arrays
from .interchange import interchange_mesh
from .mesh_indices import CODES, Element, any_line_begins, check_mesh, parsed_header, ply_header
from .trimesh import TriangleMesh, vertex_normals

# Mitsuba's exceptions, text that is not UTF-8, and sizes beyond the memory
# What Mitsuba says before the mistake: places in its sources, its plugins, and the file
_LOADING = re.compile(r'^.*(?:Error while loading \w+ file "[^"]*"|plugin of type "\w+"): ')
_UNREAD = (RuntimeError, ValueError, MemoryError)

KINDS = {".ply": "ply", ".obj": "obj", ".serialized": "serialized"}

# Codes of `struct`
_CODES = {name: np.dtype(code).char for name, code in CODES.items()}

# Lines of normals in an OBJ file, and corners v/t/n or v//n of its faces
_NORMAL, _CORNER = re.compile(rb"(?m)^vn .*$"), re.compile(rb"(?<= )(\d+)(/\d+)?/{1,2}\d+(?=\s|$)")


class MeshFile(NamedTuple):
    """Contents of a mesh file.

    Attributes
    ----------
    file : the file.
    mesh : the triangles, with the vertices that they name.
    own_normals : whether the file holds vertex normals; otherwise `vertex_normals` has made them.
    orientation : (n, 2) of the attribute vertex_orientation, or None.
    materials : (m,) number of each triangle's material in a glTF file; None for other files.
    """

    file: Path
    mesh: SmoothMesh
    own_normals: bool
    orientation: Real | None
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
        if loaded.has_attribute(ORIENTATION):
            turns = np.array(mi.traverse(loaded)[ORIENTATION], dtype=np.float64)
            turns = turns.reshape(loaded.vertex_count(), -1)[:, :2]
        arrays = mesh_arrays(loaded)
        # Mitsuba's normals have seams where texture coordinates have
        arrays = arrays if _states_normals(file) else arrays._replace(normals=None)
    faces, named = arrays.faces, np.zeros(len(arrays.positions), bool)
    named[faces] = True
    if not named.all():  # other vertices would count in the mesh's size
        faces = (np.cumsum(named) - 1)[faces]
    positions = arrays.positions[named]
    own, uv, turns = (
        None if rows is None else rows[named] for rows in (arrays.normals, arrays.uv, turns)
    )
    normals = vertex_normals(positions, faces, uv) if own is None else own
    mesh = SmoothMesh(positions, normals, uv, faces)
    return MeshFile(file, mesh, own is not None, turns, arrays.materials)


def load_mesh(path: str | os.PathLike[str]) -> SmoothMesh:
    """Return the triangles of `read_mesh`."""
    return read_mesh(path).mesh


def load_orientation(path: str | os.PathLike[str]) -> Real | None:
    """Return the attribute vertex_orientation of a mesh file, (n, 2); None without one."""
    return read_mesh(path).orientation


def _states_normals(file: Path) -> bool:
    """Whether a file that Mitsuba reads holds vertex normals."""
    if file.suffix.lower() == ".ply":
        header = ply_header(readable_file(file))
        vertex = [e for e in header.elements if e.name == "vertex"] if header else []
        return any(words[-1] == "nx" for element in vertex for words in element.properties)
    return file.suffix.lower() != ".obj" or any_line_begins(readable_file(file), b"vn")


def _load(file: Path) -> mi.Mesh:
    kind = KINDS[file.suffix.lower()]
    check_mesh(file, kind)
    try:
        return _read(file, kind)
    except _UNREAD as error:
        triangles = None
        # numbers and names of a damaged header or body
        with contextlib.suppress(struct.error, ValueError, LookupError, OverflowError, MemoryError):
            triangles = triangulated_ply(file.read_bytes()) if kind == "ply" else None
        if kind == "obj" and "invalid vertex normal" in str(error):
            warn(f"mesh '{file}': a vertex normal has length 0; all are rebuilt from the triangles")
            triangles = _CORNER.sub(rb"\1\2", _NORMAL.sub(b"", file.read_bytes()))
        if triangles is not None:
            with tempfile.TemporaryDirectory() as folder:
                cut = Path(folder, file.name)
                cut.write_bytes(triangles)
                check_mesh(cut, kind, shown=f"mesh '{file}'")
                with contextlib.suppress(*_UNREAD):
                    return _read(cut, kind)
        reason = _LOADING.sub("", " ".join(str(error).split())).rstrip("!. ")[-200:]
        raise DiffractionError(
            f"mesh '{file}': cannot be read: {reason or type(error).__name__}; export it again"
        ) from error


def _read(file: Path, kind: str) -> mi.Mesh:
    return mi.load_dict({"type": kind, "filename": str(file)})


def write_ply(
    path: str | os.PathLike[str], mesh: TriangleMesh, comment: str = "", *, with_uv: bool = True
) -> None:
    """Write a binary PLY, with the names of properties that Mitsuba writes.

    An orientation becomes the mesh attribute `vertex_orientation` with the channels (cos, sin, 0):
    Mitsuba 3.9 reads attributes of one or three channels and ignores attributes of two.

    Raises a DiffractionError if the file cannot be written.
    """
    blocks = {"x y z": mesh.positions, "nx ny nz": mesh.normals}
    if with_uv:
        blocks["s t"] = mesh.uv
    if mesh.orientation is not None:
        turn = ORIENTATION.removeprefix("vertex_")
        blocks[f"{turn}_0 {turn}_1 {turn}_2"] = np.pad(mesh.orientation, [(0, 0), (0, 1)])
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
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write("\n".join(header).encode("ascii", "replace"))
        file.write(vertices.tobytes())
        file.write(faces.tobytes())


def triangulated_ply(data: bytes) -> bytes | None:
    """Cut the polygons of a PLY file into fans of triangles, as Mitsuba cuts polygons of OBJ.

    Faces must come after vertices; the result has nothing else. None for other files.
    """
    header = parsed_header(data, "")
    if header is None or [e.name for e in header.elements[:2]] != ["vertex", "face"]:
        return None
    (vertex, face), body = header.elements[:2], data[header.size :]
    text = header.format == "ascii"
    read = _rows_of_text if text else _rows_of_bytes
    end, polygons = read(body, vertex, face, header.order)
    triangles = [(p[0], p[n], p[n + 1]) for p in polygons for n in range(1, len(p) - 1)]
    lines = [
        "ply", f"format {header.format} 1.0", f"element vertex {vertex.number}",
        *(f"property {' '.join(words)}" for words in vertex.properties),
        f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header",
        "",
    ]  # fmt: skip
    if text:
        faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in triangles).encode()
    else:
        faces = b"".join(struct.pack(f"{header.order}B3i", 3, *each) for each in triangles)
    return "\n".join(lines).encode("latin-1") + body[:end] + faces


def _rows_of_text(
    body: bytes, vertex: Element, face: Element, _: str
) -> tuple[int, list[tuple[int, ...]]]:
    """Return where the vertices end, and the corners of each face."""
    lines = body.splitlines(keepends=True)
    if face.properties[0][0] != "list":
        raise ValueError
    polygons = []
    for line in lines[vertex.number : vertex.number + face.number]:
        size, *corners = (int(float(word)) for word in line.split())
        polygons.append(tuple(corners))
        if len(corners) != size:
            raise ValueError
    if len(polygons) < face.number:
        raise ValueError
    return sum(map(len, lines[: vertex.number])), polygons


def _rows_of_bytes(
    body: bytes, vertex: Element, face: Element, order: str
) -> tuple[int, list[tuple[int, ...]]]:
    """Return where the vertices end, and the corners of each face."""
    # lists at vertices are none of these codes: KeyError
    at = end = vertex.number * struct.calcsize(
        order + "".join(_CODES[w[0]] for w in vertex.properties)
    )
    polygons = []
    for _ in range(face.number):
        for words in face.properties:
            size = 1
            if words[0] == "list":
                (size,) = struct.unpack_from(order + _CODES[words[1]], body, at)
                at += struct.calcsize(order + _CODES[words[1]])
            values = f"{order}{size}{_CODES[words[-2]]}"
            if words[-1] in ("vertex_indices", "vertex_index"):
                polygons.append(struct.unpack_from(values, body, at))
            at += struct.calcsize(values)
    return end, polygons
