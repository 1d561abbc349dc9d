"""Mesh files checked before Mitsuba reads them: counts, and vertices that triangles name.

Mitsuba 3.9 follows an index of a PLY or serialized mesh wherever it points, which ends the process,
and allocates what a header states. It checks OBJ files itself.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Whole
from ...errors import DiffractionError, counted, quoted
from ...limits import check_content

# Formats of the content of a PLY file, and NumPy's codes of the order of their bytes
_FORMATS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
# NumPy's codes of the types of a PLY file
_CODES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
# Bytes at the beginning of a file within which the header of a PLY ends
_LONGEST_HEADER = 1 << 20
# Mitsuba's serialized format: first number of a file, and flags of a mesh
_SERIALIZED, _NORMALS, _UV, _COLOURS, _DOUBLE = 0x041C, 0x1, 0x2, 0x8, 0x2000
_LONGEST_NAME = 4096


class Element(NamedTuple):
    """Element of a PLY file.

    Attributes
    ----------
    number : of such elements.
    properties : words of each line after `property`: type and name, or `list`, two types and name.
    """

    number: int
    properties: list[list[str]]


class Header(NamedTuple):
    """Header of a PLY file: its format, elements by name, and where its content begins."""

    format: str
    elements: dict[str, Element]
    size: int

    def type_of(self, word: str) -> np.dtype[Any]:
        """Return the type of the numbers in the content that the file calls by this word."""
        code = "f8" if self.format == "ascii" else _CODES[word]
        return np.dtype(_FORMATS[self.format] + code)

    def row(self, element: Element, length: int) -> np.dtype[Any]:
        """Return the type of a row of an element in the content, whose lists have this length."""
        fields: list[Any] = []
        for n, words in enumerate(element.properties):
            types = [self.type_of(word) for word in words[:-1] if word != "list"]
            fields.append((f"{n}", types[0]))
            if words[0] == "list":
                fields.append((f"{n} values", types[1], (length,)))
        return np.dtype(fields)

    def content(self, file: Path, shown: str) -> NDArray[np.uint8]:
        """Return the bytes after the header; of a text, its numbers in double precision.

        Raises a DiffractionError if a text is not all numbers.
        """
        if self.format != "ascii":
            empty = file.stat().st_size <= self.size
            return np.empty(0, np.uint8) if empty else np.memmap(file, np.uint8, "r", self.size)
        with file.open("rb") as stream:
            stream.seek(self.size)
            try:
                return np.fromstring(stream.read(), "<f8", sep=" ").view(np.uint8)
            except (ValueError, DeprecationWarning) as error:
                raise DiffractionError(f"{shown}: its text is not all numbers") from error


def check_mesh(file: Path, kind: str, number: int = 0) -> None:
    """Refuse a mesh file that Mitsuba cannot read safely.

    kind : Mitsuba's plugin: `ply`, `serialized`, `obj`; others are not checked.
    number : of the mesh in a serialized file.

    Raises a DiffractionError if a triangle names a vertex that does not exist, the file is shorter
    than its header states, or it has no triangles: Dr.Jit compiles kernels for all meshes alive,
    and one without triangles would break every later rendering of the process.
    """
    shown = f"mesh '{file}'"
    triangles = None
    if kind == "ply":
        read_ply(file, shown)
    elif kind == "serialized":
        triangles = _check_serialized(file, number, shown)
    elif kind == "obj" and next(rests_of_lines(file, b"f"), None) is None:
        triangles = 0
    if triangles == 0:
        raise DiffractionError(f"{shown}: it has no triangles")


def rests_of_lines(file: Path, word: bytes) -> Iterator[str]:
    """Yield what follows a word, in the lines of an OBJ file that begin with this word."""
    with file.open("rb") as lines:
        for line in map(bytes.strip, lines):
            if line.startswith((word + b" ", word + b"\t")):
                yield line[len(word) :].strip().decode("utf-8", "replace")


def ply_header(file: Path, shown: str) -> Header:
    """Return the header of a PLY file.

    Raises a DiffractionError for other files, and if the header has no end, or an element has no
    properties or an unknown type.
    """
    with file.open("rb") as stream:
        start = stream.read(_LONGEST_HEADER)
    if not re.match(rb"ply\s", start):
        todo = f"run the command 'tangents {file} -o mesh.ply' first, and use mesh.ply"
        if file.suffix.lower() not in (".obj", ".serialized"):
            todo = "convert it to PLY or OBJ"
        raise DiffractionError(f"{shown} is not a PLY, which is expected: {todo}")
    form, elements = "", dict[str, Element]()
    end = re.search(rb"\nend_header[ \t\r]*\n", start)
    if end is None:
        raise DiffractionError(
            f"{shown} is a damaged PLY: its header has no end; export the mesh again"
        )
    for line in start[: end.start()].decode("latin-1").split("\n")[1:]:
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1:
            form = words[1]
        elif words[:1] == ["element"]:
            number = words[2] if len(words) > 2 else ""
            if not number.isdecimal() or len(number) > 18 or words[1] in elements:
                raise DiffractionError(
                    f"{shown}: {quoted(line.strip())} cannot be an element, or is there twice"
                )
            elements[words[1]] = element = Element(int(number), [])
        elif words[:1] == ["property"]:
            types = words[2:4] if words[1:2] == ["list"] else words[1:2]
            expected = 5 if words[1:2] == ["list"] else 3
            if not elements or len(words) < expected or any(word not in _CODES for word in types):
                raise DiffractionError(
                    f"{shown}: {quoted(line.strip())} cannot be a property of a PLY"
                )
            element.properties.append(words[1:expected])
    for name, element in elements.items():
        if element.number and not element.properties:
            raise DiffractionError(
                f"{shown}: element {quoted(name)} has no properties, {element.number} times"
            )
    if form not in _FORMATS:
        raise DiffractionError(f"{shown}: a PLY of format {quoted(form)} cannot be read")
    return Header(form, elements, end.end())


def read_ply(file: Path, shown: str) -> tuple[dict[str, NDArray[Any]], NDArray[Any]]:
    """Return numbers of a PLY file's vertices by name, and its triangles (m, 3).

    Polygons are cut into fans, as Mitsuba cuts polygons of OBJ files.

    Raises a DiffractionError if the file is no PLY, is damaged, or has no triangles.
    """
    header = ply_header(file, shown)
    elements = header.elements
    vertex, face = (elements.get(name, Element(0, [])) for name in ("vertex", "face"))
    content, triangles = header.content(file, shown), np.empty((0, 3), np.int64)
    try:
        if vertex.number and face.number:
            if sum(e.number * header.row(e, 0).itemsize for e in elements.values()) > len(content):
                raise ValueError
            # lists have three numbers, as Mitsuba expects
            sizes = [e.number * header.row(e, 3).itemsize for e in elements.values()]
            at = dict(zip(elements, np.cumsum([0, *sizes]).tolist(), strict=False))
            triangles = _triangles(header, face, content, at["face"], vertex.number, shown)
            rows = np.frombuffer(content, header.row(vertex, 3), vertex.number, at["vertex"])
    except DiffractionError:
        raise
    except (ValueError, OverflowError, MemoryError) as error:
        raise DiffractionError(
            f"{shown}: cannot be read: its {file.stat().st_size} bytes are not what its header "
            f"states ({vertex.number} vertices, {counted(face.number, 'face')}); export it again"
        ) from error
    if not len(triangles):
        raise DiffractionError(f"{shown}: it has no triangles")
    return {words[-1]: rows[f"{n}"] for n, words in enumerate(vertex.properties)}, triangles


def _triangles(
    header: Header, face: Element, content: NDArray[np.uint8], at: int, vertices: int, shown: str
) -> NDArray[Any]:
    """Return the triangles (m, 3) of faces whose rows begin at a byte of the content.

    Raises a DiffractionError if one names no vertex, a ValueError if the content is too short.
    """
    lists = {n: words for n, words in enumerate(face.properties) if words[0] == "list"}
    named = [n for n, words in lists.items() if words[3] in ("vertex_indices", "vertex_index")]
    row = header.row(face, 3)
    if at + face.number * row.itemsize <= len(content):
        rows = np.frombuffer(content, row, face.number, at)
        if all((rows[f"{n}"] == 3).all() for n in lists):
            for n, words in lists.items():
                if n in named or not words[2].startswith(("float", "double")):
                    check_indices(rows[f"{n} values"], vertices, shown)
            return np.asarray(rows[f"{named[-1]} values"]) if named else np.empty((0, 3), np.int64)
    counts, polygons = [], []
    for _ in range(face.number):
        for n, words in enumerate(face.properties):
            size = 1
            if n in lists:
                kind = header.type_of(words[1])
                size = int(np.frombuffer(content, kind, 1, at)[0])
                at += kind.itemsize
            kind = header.type_of(words[-2])
            if size < 0:
                raise ValueError
            if n in named:
                counts.append(size)
                polygons.append(np.frombuffer(content, kind, size, at))
            at += size * kind.itemsize
    corners = np.concatenate(polygons)
    check_indices(corners, vertices, shown)
    return np.asarray(corners[fans(np.array(counts))])


def fans(counts: Whole) -> Whole:
    """Return the triangles (m, 3) of polygons, by the numbers of their corners in a row.

    counts : corners of each polygon.
    """
    triangles = np.maximum(counts - 2, 0)
    first = np.repeat(np.cumsum(counts) - counts, triangles)
    step = np.arange(len(first)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return np.stack([first, first + step + 1, first + step + 2], axis=-1).astype(np.int64)


def check_indices(corners: NDArray[Any], vertices: int, shown: str) -> None:
    """Refuse triangles that name a vertex which does not exist.

    Raises a DiffractionError that names the first one.
    """
    with np.errstate(invalid="ignore"):
        wrong = corners[~((corners >= 0) & (corners <= vertices - 1))]
    if len(wrong):
        raise DiffractionError(
            f"{shown}: a triangle names vertex {wrong[0]:.10g}, but there are only {vertices}; "
            "export the mesh again"
        )


def _check_serialized(file: Path, number: int, shown: str) -> int:
    """Check one mesh of Mitsuba's own format, as Mitsuba 3.9 reads it."""
    size = file.stat().st_size
    with file.open("rb") as stream:
        try:
            start, version = _place(stream, size, number)
            stream.seek(start)
            inflate = zlib.decompressobj()
            head = inflate.decompress(stream.read(), 4 + _LONGEST_NAME + 16)
            (flags,) = struct.unpack_from("<I", head)
            counts = 4 if version == 3 else head.index(b"\0", 4) + 1  # after the name
            vertices, faces = struct.unpack_from("<QQ", head, counts)
            numbers = 3 + 3 * bool(flags & _NORMALS) + 2 * bool(flags & _UV)
            numbers += 3 * bool(flags & _COLOURS)
            before = vertices * numbers * (8 if flags & _DOUBLE else 4)
            check_content(before + 12 * faces, size, shown)
            first = counts + 16 + before
            rest = max(1, first + 12 * faces - len(head))
            content = head + inflate.decompress(inflate.unconsumed_tail, rest)
            corners = np.frombuffer(content, "<u4", 3 * faces, first)
        except (struct.error, ValueError, zlib.error) as error:
            if isinstance(error, DiffractionError):
                raise
            raise DiffractionError(
                f"{shown}: it is damaged, or not Mitsuba's format; export the mesh again"
            ) from error
    check_indices(corners, vertices, shown)
    return int(faces)


def _place(stream: Any, size: int, number: int) -> tuple[int, int]:
    """Return where the compressed content of a mesh begins, and the version of the file.

    Raises a ValueError for other files.
    """
    kind, version = struct.unpack("<HH", stream.read(4))
    if kind != _SERIALIZED or version not in (3, 4) or number < 0:
        raise ValueError
    if number == 0:
        return 4, version
    stream.seek(size - 4)
    (count,) = struct.unpack("<I", stream.read(4))
    width, code = (8, "<Q") if version == 4 else (4, "<I")
    place = size - 4 - width * (count - number)
    if number >= count or place < 0:
        raise ValueError
    stream.seek(place)
    (start,) = struct.unpack(code, stream.read(width))
    if start >= size:
        raise ValueError
    return start + 4, version
