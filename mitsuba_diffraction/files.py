"""Input files, looked at before they are opened: every reader of the package goes through here.

`kind_of` alone decides the kind of a file.

Opening a pipe waits for somebody to write, and a device has no end. Mitsuba and OpenEXR accept
names in UTF-8 only.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
import struct
import tomllib
import warnings
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any

from .errors import DiffractionError, one_line, quoted
from .inputs import note_input
from .limits import LARGEST_FILE, LARGEST_TEXT, MOST_KEY_PARTS

#: Attribute of an EXR file that makes it a table; the JSON in it holds everything but coefficients.
TABLE_ATTRIBUTE = "mitsuba_diffraction"
#: Attribute that tells tables of orders from other NetCDF files.
ORDERS_ATTRIBUTE = "mitsuba_diffraction_orders"
#: Name of this program in a plot.
SOFTWARE = "mitsuba-diffraction"
#: First columns of the CSV files that this program writes, by which they are told from scans.
RESULTS = (
    ("wl",), ("spectrum",), ("group", "scan"), ("patch1", "patch2"), ("file", "sample"),
    ("sample", "scans"), ("frequency_per_um",), ("wavelength_nm", "ridge_deg"),
    ("value", "seconds"), ("theta_i_deg", "phi_i_deg"),
)  # fmt: skip
#: Suffixes of glTF and USD, which optional packages read.
GLTF, USD = (".glb", ".gltf"), (".usd", ".usda", ".usdc", ".usdz")
#: Suffixes of mesh files; the first three are read by Mitsuba.
MESHES = (".ply", ".obj", ".serialized", *GLTF, *USD)
#: Suffixes of mesh files that have to be converted first.
OTHER_MESHES = (".stl", ".fbx", ".dae", ".3ds", ".3mf", ".off", ".blend")


class FileKind(StrEnum):
    """Kind of a file; all but the first five and the last are heights, named by their reader."""

    TABLE = "table"
    ORDERS = "table of orders"
    RECIPE = "recipe"
    MESH = "mesh"
    SCENE = "scene"
    IMAGE = "image"
    EXR = "EXR image"
    NPY = "array"
    TEXT = "text"
    JPEG = "JPEG"
    INSTRUMENT = "instrument file"
    RESULT = "plot or table of results"


# First bytes, a text among the bytes at the beginning, and the kind of the file; attributes of EXR
# and NetCDF files stand there. Content decides before the suffix does: a misnamed file still loads.
_BEGINNING = 1 << 16
_CONTENTS = (
    (b"\x76\x2f\x31\x01", f"\0{TABLE_ATTRIBUTE}\0string\0".encode(), FileKind.TABLE),
    (b"\x76\x2f\x31\x01", b"", FileKind.EXR),
    (b"CDF", ORDERS_ATTRIBUTE.encode(), FileKind.ORDERS),
    (b"\x89PNG\r\n\x1a\n", f"Software\0{SOFTWARE}".encode(), FileKind.RESULT),
    (b"\x89PNG\r\n\x1a\n", b"", FileKind.IMAGE),
    (b"\x93NUMPY", b"", FileKind.NPY),
    (b"\xff\xd8\xff", b"", FileKind.JPEG),
    (b"PK\3\4", b"wavelengths.npy", FileKind.RESULT),  # `evaluate`
    *((f"{','.join(names)},".encode(), b"", FileKind.RESULT) for names in RESULTS),
)
_SUFFIXES = {
    ".toml": FileKind.RECIPE, ".xml": FileKind.SCENE, ".exr": FileKind.EXR, ".npy": FileKind.NPY,
    **dict.fromkeys((*MESHES, *OTHER_MESHES), FileKind.MESH),
    **dict.fromkeys((".png", ".bmp", ".tif", ".tiff"), FileKind.IMAGE),
    **dict.fromkeys((".txt", ".csv", ".tsv", ".xyz"), FileKind.TEXT),
}  # fmt: skip
# Keys of TOML with more parts; possessive, so that the search takes a step for each letter
_KEY = r"""(?:(?<![\w-])[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_LONG_KEY = re.compile(f"(?:{_KEY}){{{MOST_KEY_PARTS}}}")
# Private tags of TIFF files with physical heights: of Park Systems, and JPK's length of a scan.
_INSTRUMENT_TAGS = {50432, 0x8042}


def kind_of(path: str | os.PathLike[str]) -> FileKind:
    """Return the kind of a file by its content, else by its suffix.

    The suffix alone decides for a file that cannot be read: its reader says why.
    """
    content = b""
    with contextlib.suppress(DiffractionError):
        content = beginning(path, _BEGINNING)
    for begins, attribute, kind in _CONTENTS:
        if content.startswith(begins) and attribute in content:
            return kind
    if content.startswith((b"II*\0", b"MM\0*")) and Path(path).suffix.lower() != ".lext":
        instrument = not _INSTRUMENT_TAGS.isdisjoint(tiff_tags(Path(path)))
        return FileKind.INSTRUMENT if instrument else FileKind.IMAGE
    return _SUFFIXES.get(Path(path).suffix.lower(), FileKind.INSTRUMENT)


def tiff_tags(file: Path) -> Mapping[int, Any]:
    """Return the tags of a TIFF's first page, as Pillow's `ImageFileDirectory_v2` gives them.

    An incomplete directory gives the tags that are whole.
    """
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    with file.open("rb") as stream, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            tags = ImageFileDirectory_v2(stream.read(8))
            stream.seek(tags.next)
            tags.load(stream)
        except (OSError, SyntaxError, struct.error):
            return {}
    return tags


def readable_file(path: str | os.PathLike[str]) -> Path:
    """Return the path of a regular file that can be read and has content.

    Raises a DiffractionError if the file is missing, a folder, a pipe or a device, unreadable or
    empty, or if its name is not UTF-8.
    """
    beginning(path, 1)
    note_input(path)
    return Path(path)


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def beginning(path: str | os.PathLike[str], count: int) -> bytes:
    """Return the first bytes of a file, `count` at most; errors as in `readable_file`."""
    shown = repr(os.fspath(path))
    check_name(path)
    try:
        file = Path(path)
        refuse_pipe(file)
        if file.is_dir():
            raise DiffractionError(f"{shown} is a folder; name a file in it")
        # some files of /proc wait for content as a pipe does
        with open(file, "rb", opener=_without_waiting) as stream:
            first, size = stream.read(count), os.fstat(stream.fileno()).st_size
    except DiffractionError:
        raise
    except FileNotFoundError as error:
        raise DiffractionError(f"{shown} does not exist; check the path") from error
    except OSError as error:
        raise DiffractionError(f"cannot read {shown}: {error.strerror}") from error
    except ValueError as error:  # a null character in the name
        raise DiffractionError(f"cannot read {shown}: {error}") from error
    if not first:
        raise DiffractionError(f"{shown} is empty (0 bytes)")
    if not size:
        raise DiffractionError(
            f"{shown} has content without a size, as files of /proc; copy it, and name the copy"
        )
    return first


def path_beside(file: Path, name: str, *, output: bool = False) -> Path:
    """Return the path of an input, or output, that a file names, relative to the file's folder.

    Raises a DiffractionError if it leads out of the folder: absolute, by "..", or by a link.
    """
    path = file.parent / name
    if not path.resolve().is_relative_to(file.parent.resolve()):
        raise DiffractionError(
            f"{str(file)!r}: output: {name!r} is outside the file's folder; name a path in it"
            if output else
            f"{str(file)!r} names {quoted(name)}, which is outside of its folder; copy that there"
        )  # fmt: skip
    return path


def read_bytes(path: str | os.PathLike[str], largest: int = LARGEST_FILE) -> bytes:
    """Return the content of a file of at most `largest` bytes.

    Raises a DiffractionError as `readable_file` does, or if the file is larger.
    """
    file = readable_file(path)
    try:
        if (size := file.stat().st_size) > largest:
            raise DiffractionError(
                f"{str(file)!r} is too large: {size} bytes, at most {largest} are read; is it the "
                "right file?"
            )
        return file.read_bytes()
    except OSError as error:
        raise DiffractionError(f"cannot read {str(file)!r}: {error.strerror}") from error


def read_text(path: str | os.PathLike[str]) -> str:
    """Return the content of a text file in UTF-8 of at most `LARGEST_TEXT` bytes.

    Raises a DiffractionError as `readable_file` does, or if the file is larger, or not text.
    """
    try:
        return read_bytes(path, LARGEST_TEXT).decode("utf-8")
    except UnicodeDecodeError as error:
        raise DiffractionError(f"{os.fspath(path)!r} is not text (UTF-8)") from error


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the content of a TOML file, whose whole numbers fit 64 bits, as TOML has them.

    Raises a DiffractionError as `read_text` does, or if the file is not TOML.
    """
    text = read_text(path)
    if long := _LONG_KEY.search(text):
        line = text.count("\n", 0, long.start()) + 1
        raise DiffractionError(
            f"{os.fspath(path)!r}, line {line}: a key may have {MOST_KEY_PARTS} parts with dots "
            "between"
        )
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: also numbers of 5,000 digits
        raise DiffractionError(
            f"{os.fspath(path)!r} is not TOML: {one_line(str(error)).partition(';')[0]}"
        ) from error
    waiting: list[Any] = [content]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict | list):
            waiting += value.values() if isinstance(value, dict) else value
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise DiffractionError(
                f"{os.fspath(path)!r} is not TOML: the number {quoted(value)} exceeds 64 bits"
            )
    return content


def refuse_pipe(path: Path) -> None:
    """Raise a DiffractionError for what exists and is neither a regular file nor a folder."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # missing, or no name of a file: reported by who opens it
        return
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise DiffractionError(
            f"{str(path)!r} is a pipe or a device; write its content to a file, and name that"
        )


def check_name(name: str | os.PathLike[str]) -> None:
    """Raise a DiffractionError for a name that is not UTF-8."""
    try:
        os.fspath(name).encode("utf-8")
    except UnicodeEncodeError as error:
        raise DiffractionError(f"{os.fspath(name)!r} is not UTF-8; rename the file") from error
