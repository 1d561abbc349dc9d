"""Mesh files checked before Mitsuba reads them: counts, and vertices that triangles name.

Mitsuba 3.9 follows an index of a PLY or serialized mesh wherever it points, which ends the process,
and allocates what a header states. It checks OBJ files itself.
"""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError, counted, quoted
from ...limits import check_content

#: NumPy's codes of the types of a PLY file.
CODES = {
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
    name, number : `vertex`, `face` or others, and how many.
    properties : words of each line after `property`: type and name, or `list`, two types and name.
    """

    name: str
    number: int
    properties: list[list[str]]

    def dtype(self, order: str) -> np.dtype[Any]:
        """Return the type of a row, whose lists have three numbers, as Mitsuba expects."""
        fields: list[Any] = []
        for n, words in enumerate(self.properties):
            types = [order + CODES[word] for word in words[:-1] if word != "list"]
            fields.append((f"{n}", types[0]))
            if words[0] == "list":
                fields.append((f"{n} values", types[1], (3,)))
        return np.dtype(fields)


class Header(NamedTuple):
    """Header of a PLY file: its format, elements, and the place where its content begins."""

    format: str
    elements: list[Element]
    size: int

    @property
    def order(self) -> str:
        """NumPy's code of the order of bytes."""
        return ">" if self.format == "binary_big_endian" else "<"


def check_mesh(file: Path, kind: str, number: int = 0, shown: str = "") -> None:
    """Refuse a mesh file that Mitsuba cannot read safely.

    kind : Mitsuba's plugin: `ply`, `serialized`, `obj`; others are not checked.
    number : of the mesh in a serialized file.
    shown : the file in messages.

    Raises a DiffractionError if a triangle names a vertex that does not exist, the file is shorter
    than its header states, or it has no triangles: Dr.Jit compiles kernels for all meshes alive,
    and one without triangles would break every later rendering of the process.
    """
    shown = shown or f"mesh '{file}'"
    triangles = None
    if kind == "ply":
        triangles = _check_ply(file, shown)
    elif kind == "serialized":
        triangles = _check_serialized(file, number, shown)
    elif kind == "obj" and not any_line_begins(file, b"f"):
        triangles = 0
    if triangles == 0:
        raise DiffractionError(f"{shown}: it has no triangles")


def any_line_begins(file: Path, word: bytes) -> bool:
    """Whether a line of an OBJ file begins with a word."""
    with file.open("rb") as lines:
        return any(line.lstrip().startswith((word + b" ", word + b"\t")) for line in lines)


def ply_header(file: Path, shown: str = "") -> Header | None:
    """Return the header of a PLY file; None for other files; errors as of `parsed_header`."""
    with file.open("rb") as stream:
        return parsed_header(stream.read(_LONGEST_HEADER), shown or f"mesh '{file}'")


def parsed_header(start: bytes, shown: str) -> Header | None:
    """Return the header at the beginning of a PLY file; None for other files.

    Raises a DiffractionError if it has no end, or an element has no properties or an unknown type.
    """
    if not re.match(rb"ply\s", start):
        return None
    form, elements = "", []
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
            if len(words) < 3 or not words[2].isdecimal() or len(words[2]) > 18:
                raise DiffractionError(
                    f"{shown}: {quoted(line.strip())} cannot be an element of a PLY"
                )
            elements.append(Element(words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            types = words[2:4] if words[1:2] == ["list"] else words[1:2]
            expected = 5 if words[1:2] == ["list"] else 3
            if not elements or len(words) < expected or any(word not in CODES for word in types):
                raise DiffractionError(
                    f"{shown}: {quoted(line.strip())} cannot be a property of a PLY"
                )
            elements[-1].properties.append(words[1:expected])
    names = [element.name for element in elements]
    if twice := [name for name in names if names.count(name) > 1]:
        raise DiffractionError(f"{shown}: element {quoted(twice[0])} is there twice")
    for element in elements:
        if element.number and not element.properties:
            raise DiffractionError(
                f"{shown}: element {quoted(element.name)} has no properties, {element.number} times"
            )
    return Header(form, elements, end.end())


def _check_ply(file: Path, shown: str) -> int | None:
    header = ply_header(file, shown)
    counts = {element.name: element.number for element in header.elements} if header else {}
    if header is None:
        return None
    if not counts.get("vertex") or not counts.get("face"):
        return 0
    least = sum(e.number * _least_bytes(e, header) for e in header.elements)
    if header.size + least > file.stat().st_size + 1:  # a text needs no blank at its end
        raise DiffractionError(
            f"{shown}: its {file.stat().st_size} bytes are fewer than its header states "
            f"({counts['vertex']} vertices, {counted(counts['face'], 'face')}); export the mesh "
            "again"
        )
    rows = _faces(file, header, shown)
    if rows is None:
        return None
    for n, words in enumerate(next(e for e in header.elements if e.name == "face").properties):
        if words[0] != "list":
            continue
        if (rows[f"{n}"] != 3).any():
            return None  # polygons, which Mitsuba refuses
        if words[2] not in ("float", "float32", "double", "float64") or "vertex" in words[3]:
            check_indices(rows[f"{n} values"], counts["vertex"], shown)
    return counts["face"]


def _least_bytes(element: Element, header: Header) -> int:
    """Return the bytes of the shortest row of an element, whose lists are empty."""
    if header.format == "ascii":
        return 2 * len(element.properties)
    return sum(np.dtype(CODES[w[1] if w[0] == "list" else w[0]]).itemsize
               for w in element.properties)  # fmt: skip


def _faces(file: Path, header: Header, shown: str) -> Any:
    """Return the faces as Mitsuba reads them, if all are triangles; else some rows, or None."""
    if header.format == "ascii":
        return _faces_of_text(file, header, shown)
    start = header.size
    for element in header.elements:
        row = element.dtype(header.order)
        if element.name != "face":
            start += element.number * row.itemsize
            continue
        if start + element.number * row.itemsize > file.stat().st_size:
            return None  # no triangles alone, or too short
        return np.memmap(file, row, "r", start, element.number) if element.number else None
    return None


def _faces_of_text(file: Path, header: Header, shown: str) -> Any:
    """Return the faces of a PLY in text, as a dictionary of columns; None if there are too few."""
    with file.open("rb") as stream:
        stream.seek(header.size)
        try:
            numbers = np.fromstring(stream.read(), np.float64, sep=" ")
        except (ValueError, DeprecationWarning) as error:
            raise DiffractionError(f"{shown}: its text is not all numbers") from error
    start = 0
    for element in header.elements:
        widths = [4 if words[0] == "list" else 1 for words in element.properties]
        size = element.number * sum(widths)
        if element.name == "face":
            if start + size > len(numbers):
                return None
            rows = numbers[start : start + size].reshape(element.number, -1)
            places = np.cumsum([0, *widths])
            columns = {f"{n}": rows[:, place] for n, place in enumerate(places[:-1])}
            values = {f"{n} values": rows[:, p + 1 : p + 4] for n, p in enumerate(places[:-1])}
            return columns | values
        start += size
    return None


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
            content = _Inflated(stream, start)
            (flags,) = struct.unpack("<I", content.read(4))
            if version == 4:
                _skip_name(content)
            vertices, faces = struct.unpack("<QQ", content.read(16))
            numbers = 3 + 3 * bool(flags & _NORMALS) + 2 * bool(flags & _UV)
            numbers += 3 * bool(flags & _COLOURS)
            before = vertices * numbers * (8 if flags & _DOUBLE else 4)
            check_content(before + 12 * faces, size, shown)
            content.skip(before)
            corners = np.frombuffer(content.read(12 * faces), "<u4")
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
    if number >= count:
        raise ValueError
    stream.seek(size - 4 - width * (count - number))
    return struct.unpack(code, stream.read(width))[0] + 4, version


def _skip_name(content: _Inflated) -> None:
    for _ in range(_LONGEST_NAME):
        if content.read(1) == b"\0":
            return
    raise ValueError


class _Inflated:
    """Content of a zlib stream, inflated as far as it is read."""

    def __init__(self, stream: Any, start: int) -> None:
        stream.seek(start)
        self._stream, self._inflate, self._rest = stream, zlib.decompressobj(), b""

    def read(self, count: int) -> bytes:
        """Return so many bytes; raises a ValueError if there are fewer."""
        parts: list[bytes] = []
        while count:
            if not self._rest:
                packed = self._inflate.unconsumed_tail or self._stream.read(1 << 16)
                self._rest = self._inflate.decompress(packed, 1 << 20)
                if not packed and not self._rest:
                    raise ValueError
            parts.append(self._rest[:count])
            self._rest = self._rest[count:]
            count -= len(parts[-1])
        return b"".join(parts)

    def skip(self, count: int) -> None:
        """Pass over so many bytes."""
        while count:
            step = min(count, 1 << 20)
            self.read(step)
            count -= step
