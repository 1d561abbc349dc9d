"""PLY files of polygons as PLY files of triangles, which are all that Mitsuba reads."""

from __future__ import annotations

import re
import struct

_CODES = {
    "char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h",
    "ushort": "H", "uint16": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I",
    "float": "f", "float32": "f", "double": "d", "float64": "d",
}  # fmt: skip


def triangulated_ply(data: bytes) -> bytes | None:
    """A PLY file whose polygons are cut into fans of triangles, as Mitsuba cuts those of OBJ.

    Parameters
    ----------
    data : the file, whose faces come after its vertices.

    Returns
    -------
    bytes or None
        Of a file with vertices and triangles alone; None where the file is no such PLY.
    """
    try:
        return _triangulated(data)
    # what a damaged header or body makes of its numbers and names
    except (struct.error, ValueError, LookupError, OverflowError, MemoryError):
        return None


def _triangulated(data: bytes) -> bytes | None:
    found = re.match(rb"ply\r?\n(?:.*\n)*?end_header\r?\n", data)
    if found is None:
        return None
    header = found[0].decode("latin-1").splitlines()
    starts = [n for n, line in enumerate(header) if line.startswith("element ")]
    elements = [header[a:b] for a, b in zip(starts, [*starts[1:], -1], strict=True)]
    if [e[0].split()[1] for e in elements[:2]] != ["vertex", "face"]:
        return None
    read = _read_ascii if any("format ascii" in line for line in header) else _read_binary
    order = ">" if any("binary_big_endian" in line for line in header) else "<"
    vertices, polygons = read(data[found.end() :], elements[0], elements[1], order)
    triangles = [(p[0], p[n], p[n + 1]) for p in polygons for n in range(1, len(p) - 1)]
    kept = [
        *header[: starts[1]], f"element face {len(triangles)}",
        "property list uchar int vertex_indices", "end_header", "",
    ]  # fmt: skip
    if read is _read_ascii:
        faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in triangles).encode()
    else:
        faces = b"".join(struct.pack(f"{order}B3i", 3, *triangle) for triangle in triangles)
    return "\n".join(kept).encode("latin-1") + vertices + faces


def _read_ascii(
    body: bytes, vertex: list[str], face: list[str], _: str
) -> tuple[bytes, list[list[int]]]:
    """The vertices' part of the file, and the corners of each face."""
    count, faces = (int(e[0].split()[2]) for e in (vertex, face))
    lines = body.splitlines(keepends=True)
    if not face[1].startswith("property list"):
        raise ValueError
    polygons = []
    for line in lines[count : count + faces]:
        size, *corners = (int(float(word)) for word in line.split())
        polygons.append(corners)
        if len(corners) != size:
            raise ValueError
    if len(polygons) < faces:
        raise ValueError
    return b"".join(lines[:count]), polygons


def _read_binary(
    body: bytes, vertex: list[str], face: list[str], order: str
) -> tuple[bytes, list[list[int]]]:
    """The vertices' part of the file, and the corners of each face."""
    count, faces = (int(e[0].split()[2]) for e in (vertex, face))
    # lists at vertices are none of these codes: KeyError
    row = order + "".join(_CODES[line.split()[1]] for line in vertex[1:])
    at = end = count * struct.calcsize(row)
    properties = [line.split() for line in face[1:]]
    polygons = []
    for _ in range(faces):
        for words in properties:
            if words[1] != "list":
                at += struct.calcsize(order + _CODES[words[1]])
                continue
            (size,) = struct.unpack_from(order + _CODES[words[2]], body, at)
            at += struct.calcsize(order + _CODES[words[2]])
            corners = f"{order}{size}{_CODES[words[3]]}"
            if words[4] in ("vertex_indices", "vertex_index"):
                polygons.append(list(struct.unpack_from(corners, body, at)))
            at += struct.calcsize(corners)
    if len(polygons) < faces:
        raise ValueError
    return body[:end], polygons
