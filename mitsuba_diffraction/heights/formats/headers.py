"""Sizes of scans by the headers of instrument files: a witness beside the library that reads them.

Each function takes the beginning of a file and returns what its header states about the images.
"""

from __future__ import annotations

import mmap
import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ...files import tiff_tags
from ..lengths import micrometres_of

_HEADER = 1 << 17  # bytes, more than any header
_IMAGE = re.compile(r"\\\*Ciao image list(.*?)(?=\\\*|\Z)", re.DOTALL)
_SIZE = re.compile(r"\\Scan Size: ([\d.eE+-]+) ([\d.eE+-]+) (~m|[^\s\\]+)", re.IGNORECASE)
_ASPECT = re.compile(r"\\Aspect ratio: ([\d.]+):([\d.]+)", re.IGNORECASE)
_SLOW = re.compile(r"\\Slow Axis Size: ([\d.eE+-]+) (~m|[^\s\\]+)", re.IGNORECASE)
_ROWS = re.compile(r"\\Number of lines: (\d+)", re.IGNORECASE)
_LINES = re.compile(r"\\Lines: (\d+)", re.IGNORECASE)
# A data field of Gwyddion's container with its size in bytes, and its lengths.
_GWY_FIELD = re.compile(rb"/\d+/data\0oGwyDataField\0(.{4})", re.DOTALL)
_GWY_LENGTHS = (
    re.compile(rb"xreal\0d(.{8})", re.DOTALL),
    re.compile(rb"yreal\0d(.{8})", re.DOTALL),
    re.compile(rb"si_unit_xy\0oGwySIUnit\0.{4}unitstr\0s([^\0]*)\0", re.DOTALL),
)


class Stated(NamedTuple):
    """Size of an image as a header states it.

    Attributes
    ----------
    width, height : µm, along the rows and across them.
    words : what else the header says about them, for messages; "" without.
    span : µm from the lowest height to the highest; None if the header does not say.
    """

    width: float
    height: float
    words: str = ""
    span: float | None = None


def stated_sizes(path: Path) -> list[Stated]:
    """Return the sizes of the images of a file, each once; empty for formats without a witness."""
    with path.open("rb") as stream:
        head = stream.read(_HEADER)
    for begins, witness in _WITNESSES:
        if head.startswith(begins):
            # a header that the witness does not understand says nothing
            with suppress(Exception):
                sizes = witness(path, head)
                return list(dict.fromkeys(s for s in sizes if s.width > 0.0 and s.height > 0.0))
    return []


def _nanoscope(path: Path, head: bytes) -> Iterator[Stated]:
    r"""Two equal lengths and an aspect ratio, width to height, or two lengths that differ."""
    text = head.decode("latin-1")
    for image in _IMAGE.findall(text):
        size, aspect = _SIZE.search(image), _ASPECT.search(image) or _ASPECT.search(text)
        unit = size and micrometres_of(size[3].replace("~m", "µm"))
        if not (size and unit):
            continue
        width, height = float(size[1]) * unit, float(size[2]) * unit
        across, along = (float(aspect[1]), float(aspect[2])) if aspect else (1.0, 1.0)
        if not min(width, height, across, along) > 0.0:
            return
        if abs(height / width - 1.0) < 1e-3:
            height = width * along / across
        slow, rows = _SLOW.search(text), _ROWS.search(image)
        if slow is None or (slow_unit := micrometres_of(slow[2].replace("~m", "µm"))) is None:
            yield Stated(width, height, f"aspect ratio {across:g}:{along:g}")
            return
        # the length of the slow axis, of which a capture that was stopped has a part
        height, lines = float(slow[1]) * slow_unit, _LINES.search(text)
        yield Stated(width, height, "slow axis size")
        if rows and lines and 0 < int(rows[1]) < int(lines[1]):
            yield Stated(width, height * int(rows[1]) / int(lines[1]), "part of the slow axis")
        return


def _gwyddion(path: Path, head: bytes) -> Iterator[Stated]:
    """`xreal` and `yreal` of each data field, in the unit `si_unit_xy`, metres without prefix."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as file:
        at = 0
        while field := _GWY_FIELD.search(file, at):
            at = field.end() + int.from_bytes(field[1], "little")
            x, y, unit = (part.search(file, field.end(), at) for part in _GWY_LENGTHS)
            factor = micrometres_of(unit[1].decode("utf-8", "replace")) if unit else None
            if x and y and factor is not None:
                width, height = (abs(*struct.unpack("<d", part[1])) for part in (x, y))
                yield Stated(width * factor, height * factor)


def _x3p(path: Path, head: bytes) -> Iterator[Stated]:
    """`Increment`, m, of CX and CY times the size of the matrix (ISO 25178-72)."""
    with zipfile.ZipFile(path) as archive, archive.open("main.xml") as stream:
        root = ElementTree.parse(stream).getroot()
    x, y = (
        float(root.findtext(f".//{{*}}C{n}/{{*}}Increment", ""))
        * float(root.findtext(f".//{{*}}Size{n}", ""))
        * 1e6
        for n in "XY"
    )
    yield Stated(x, y)


def _sdf(path: Path, head: bytes) -> Iterator[Stated]:
    """`Xscale` and `Yscale`, m, times the numbers of points and profiles (ISO 25178-71)."""
    if head.startswith(b"b"):
        points, profiles, x, y = struct.unpack_from("<HHdd", head, 42)
    else:
        points, profiles, x, y = (
            _value(head, rf"^{name}\s*=\s*(\S+)")
            for name in ("NumPoints", "NumProfiles", "Xscale", "Yscale")
        )
    yield Stated(points * x * 1e6, profiles * y * 1e6)


def _mi(path: Path, head: bytes) -> Iterator[Stated]:
    """`xLength` and `yLength`, m; keys have 14 letters."""
    x, y = (_value(head, rf"^{axis}Length\s*(\S+)") * 1e6 for axis in "xy")
    yield Stated(x, y)


def _wsxm(path: Path, head: bytes) -> Iterator[Stated]:
    """Amplitudes along x, y and z, with their units."""
    lengths = []
    for axis, otherwise in (("X", ""), ("Y", "X"), ("Z", "")):
        match = None
        for name in filter(None, (axis, otherwise)):
            match = match or re.search(rf"^ *+{name} Amplitude: (\S+) (\S+)".encode(), head, re.M)
        unit = micrometres_of(match[2].decode("latin-1")) if match else None
        lengths.append(float(match[1]) * unit if match and unit else 0.0)
    yield Stated(lengths[0], lengths[1], span=lengths[2] or None)


def _bcr(path: Path, head: bytes) -> Iterator[Stated]:
    """`xlength` and `ylength` in `xunit`, nm without."""
    head = head.lstrip(b"\xff\xfe").replace(b"\0", b"")  # UTF-16 or Latin
    unit = re.search(rb"^xunit\s*=\s*(\S+)", head, re.MULTILINE)
    factor = micrometres_of(unit[1].decode("latin-1")) if unit else 1e-3
    x, y = (_value(head, rf"^{axis}length\s*=\s*(\S+)") for axis in "xy")
    if factor is not None:
        yield Stated(x * factor, y * factor)


def _ibw(path: Path, head: bytes) -> Iterator[Stated]:
    """Points `nDim` times steps `sfA` of the first two dimensions, in `dimUnits` (version 5)."""
    order = "<" if head.startswith(b"\5\0") else ">"
    points = struct.unpack_from(f"{order}2i", head, 132)
    steps = struct.unpack_from(f"{order}2d", head, 148)
    units = [micrometres_of(head[at : at + 4].split(b"\0")[0].decode()) for at in (216, 220)]
    width, height = (n * abs(step) for n, step in zip(points, steps, strict=True))
    if units[0] and units[1]:
        yield Stated(width * units[0], height * units[1])


def _nid(path: Path, head: bytes) -> Iterator[Stated]:
    """`Dim0Range` and `Dim1Range` of the data sets whose values are lengths."""
    for section in re.split(rb"^\[", head.split(b"#!")[0], flags=re.MULTILINE):
        fields = dict(re.findall(rb"^(Dim\d\w+)=(.*?)\r?$", section, re.MULTILINE))
        units = [fields.get(b"Dim%dUnit" % n, b"").decode("latin-1") for n in range(3)]
        x, y, z = map(micrometres_of, units)
        if x and y and z:
            yield Stated(float(fields[b"Dim0Range"]) * x, float(fields[b"Dim1Range"]) * y)


def _tiff(path: Path, head: bytes) -> Iterator[Stated]:
    """Sizes in the header of Park Systems, µm, or the grid's lengths of JPK, m."""
    park, width, height = 50435, 0x8042, 0x8043
    tags = tiff_tags(path)
    if park in tags:
        yield Stated(*struct.unpack_from("<2d", tags[park], 140))
    elif width in tags:
        yield Stated(tags[width] * 1e6, tags[height] * 1e6)


def _mdt(path: Path, head: bytes) -> Iterator[Stated]:
    """Steps of each scanned frame times its points; units are m, cm, mm, µm, nm and Å."""
    units = dict(zip(range(-5, 1), (1e6, 1e4, 1e3, 1.0, 1e-3, 1e-4), strict=True))
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as file:
        at, (count,) = 33, struct.unpack_from("<H", file, 12)
        for _ in range(count + 1):
            size, kind = struct.unpack_from("<IH", file, at)
            if kind == 0:
                (fields,) = struct.unpack_from("<H", file, at + 20)
                (x, x_unit), (y, y_unit) = (
                    struct.unpack_from("<fh", file, at + place) for place in (26, 36)
                )
                nx, ny = struct.unpack_from("<2H", file, at + 24 + fields)
                if x_unit in units and y_unit in units:
                    yield Stated(nx * abs(x) * units[x_unit], ny * abs(y) * units[y_unit])
            at += size


def _value(head: bytes, pattern: str) -> float:
    """Return the number that a pattern finds in a header of lines."""
    match = re.search(pattern.encode(), head, re.MULTILINE)
    if match is None:
        raise ValueError
    return float(match[1])


_WITNESSES: tuple[tuple[bytes, Callable[[Path, bytes], Iterator[Stated]]], ...] = (
    *((begins, _nanoscope) for begins in (b"\\*File list", b"\\*Force file list", b"?*File list")),
    (b"GWYP", _gwyddion), (b"PK\x03\x04", _x3p), (b"aISO-1.0", _sdf), (b"bISO-1.0", _sdf),
    (b"fileType", _mi), (b"WSxM file copyright", _wsxm), (b"fileformat = bcr", _bcr),
    (b"\5\0", _ibw), (b"\0\5", _ibw), (b"[DataSet]", _nid), (b"\x01\xb0\x93\xff", _mdt),
    (b"II*\0", _tiff), (b"MM\0*", _tiff),
    *((mark + "fileformat = bcr".encode("utf-16-le"), _bcr) for mark in (b"", b"\xff\xfe")),
)  # fmt: skip
