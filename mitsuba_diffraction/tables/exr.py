"""Tables as EXR files: named float channels for the coefficients, one JSON attribute for the rest.

A pixel is a bin; bin (0, 0), order 0, is in the middle, x runs along the rows, and the first row
holds the lowest frequency along y. The channel `power.I.T` holds term T of interval I of a power,
`re.I.T` and `im.I.T` the parts of an amplitude. Order 0 itself and the functions of κ that the
terms of basis "svd" are multiplied with are in the attribute, in full precision. A second attribute
has the SHA-256 of the rest of the file.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from ..atomic import atomic_path
from ..errors import DiffractionError, one_line, quoted
from ..files import TABLE_ATTRIBUTE, readable_file
from ..streams import without_chatter
from .document import document_of, parse_document, plain, shape_of, with_coefficients
from .expansion import Expansion
from .table import FORMAT_VERSION, DiffractionTable

#: Remedy for a file that is of another version, or damaged.
BUILT_AGAIN = "build it again with the command 'precompute' (DiffractionTable.build)"
#: SHA-256 of that string and of all channels, in the order of `_channels`.
CHECKSUM = "mitsuba_diffraction_sha256"

_PREFIXES = {"power": ("power",), "amplitude": ("re", "im")}
#: Coefficients as large as this are nothing to worry about; a larger table's file is not much
#: smaller than they are: a few bytes that claim to be gigabytes are no table.
_SMALL, _BEST_COMPRESSION = 1 << 26, 200


def save_table(table: DiffractionTable, path: str | os.PathLike[str]) -> None:
    """Write an EXR file: named float channels and one JSON attribute with all the rest.

    Raises a DiffractionError if it cannot be written; no half-written file is left.
    """
    if Path(path).suffix.lower() != ".exr":
        raise DiffractionError(f"cannot write '{path}': a table's file name must end with .exr")
    text = json.dumps({"version": FORMAT_VERSION, **document_of(table)}, default=plain)
    channels = {
        name: np.ascontiguousarray(table.coefficients[index])
        for name, index in _channels(table.expansion)
    }
    rows, columns = table.grid.shape
    header = {
        "displayWindow": (np.zeros(2, np.int32), np.array([columns - 1, rows - 1], np.int32)),
        TABLE_ATTRIBUTE: text,
        CHECKSUM: _checksum(text, channels),
    }
    write_channels(path, channels, header)


def write_channels(
    path: str | os.PathLike[str],
    channels: Mapping[str, NDArray[Any]],
    attributes: Mapping[str, Any] | None = None,
) -> None:
    """Write channels (ny, nx), or (ny, nx, 4) called RGBA, and attributes as an EXR file.

    Raises a DiffractionError if it cannot be written; no half-written file is left.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(attributes or {}),
    }  # fmt: skip
    contiguous = {name: np.ascontiguousarray(part) for name, part in channels.items()}
    with atomic_path(path) as temporary:
        try:
            OpenEXR.File(header, {**contiguous}).write(str(temporary))
        except RuntimeError as error:  # OpenEXR's exception for a full disk
            raise OSError(None, f"OpenEXR: {one_line(str(error))}") from error
        _check_written(temporary, contiguous)


def _check_written(file: Path, channels: Mapping[str, NDArray[Any]]) -> None:
    """Read a file back: OpenEXR loses the error of a full disk when it closes a file.

    Raises an OSError if it does not hold these channels.
    """
    single: dict[str, NDArray[Any]] = {}
    for name, part in channels.items():
        planes = dict(zip(name, np.moveaxis(part, -1, 0), strict=True)) if part.ndim == 3 else None
        single |= planes or {name: part}
    try:
        found = _read(file)
        whole = all(
            np.ascontiguousarray(plane).tobytes() == found[name].pixels.tobytes()
            for name, plane in single.items()
        )
    except (DiffractionError, LookupError):
        whole = False
    if not whole:
        raise OSError(errno.ENOSPC, "the file is cut short; is the disk full?")


def load_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """Read a table that `save_table` wrote.

    Raises a DiffractionError if the file is missing, no table, damaged, or of another format
    version.
    """
    headers = _read(path, header_only=True)
    text = headers[0].get(TABLE_ATTRIBUTE)
    try:
        document = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError) as error:
        raise DiffractionError(
            f"'{path}' is a damaged table (its attribute '{TABLE_ATTRIBUTE}' is no JSON); "
            f"{BUILT_AGAIN}"
        ) from error
    if not isinstance(document, dict):
        raise DiffractionError(
            f"'{path}' is an EXR image but no table; make a table with the command "
            "'precompute' (DiffractionTable.build), or give it as filename"
        )
    version = document.pop("version", None)
    if version != FORMAT_VERSION:
        raise DiffractionError(
            f"'{path}' is a table of format version {quoted(version)}, this program reads version "
            f"{FORMAT_VERSION}; {BUILT_AGAIN}"
        )
    try:
        table = parse_document(document)
        _check_headers(headers, table, os.path.getsize(path))
        channels = _read(path)
        planes = {name: channels[name].pixels for name, _ in _channels(table.expansion)}
        kinds = {plane.dtype for plane in planes.values()}
        if len(kinds) > 1 or not kinds <= {np.dtype(np.float16), np.dtype(np.float32)}:
            raise ValueError(f"channels of {', '.join(sorted(map(str, kinds)))}")
        if headers[0].get(CHECKSUM) != _checksum(str(text), planes):
            raise ValueError("its checksum is of another one")
        coefficients = np.empty(shape_of(table), *kinds)
        for name, index in _channels(table.expansion):
            coefficients[index] = planes[name]
        return with_coefficients(table, coefficients)
    except (DiffractionError, ValueError, MemoryError) as error:
        raise DiffractionError(
            f"'{path}' is a damaged table ({one_line(str(error))[:200]}); {BUILT_AGAIN}"
        ) from error


def _check_headers(headers: list[dict[str, Any]], table: DiffractionTable, size: int) -> None:
    """Refuse a file that is not one image as described, before its pixels are read."""
    if len(headers) != 1:
        raise ValueError(f"{len(headers)} parts, expected one")
    header = headers[0]
    rows, columns = table.grid.shape
    low, high = header["dataWindow"]
    window = [*low.tolist(), *high.tolist()]
    if window != [0, 0, columns - 1, rows - 1] or header["type"] != OpenEXR.scanlineimage:
        raise ValueError(f"pixels {window}, expected {columns} x {rows}")
    names = sorted((c.name, c.xSampling, c.ySampling) for c in header["channels"])
    if names != sorted((name, 1, 1) for name, _ in _channels(table.expansion)):
        raise ValueError(f"{len(names)} channels other than those of its terms")
    claimed = 2 * int(np.prod(shape_of(table)))
    if claimed > max(_SMALL, _BEST_COMPRESSION * size):
        raise ValueError(f"{size} bytes that claim to hold {claimed:.2g}")


def _checksum(text: str, planes: Mapping[str, NDArray[np.floating]]) -> str:
    content = hashlib.sha256(text.encode())
    for plane in planes.values():
        content.update(np.ascontiguousarray(plane).data)
    return content.hexdigest()


def _channels(expansion: Expansion) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield channel names, and the index of each in the coefficients."""
    prefixes, everywhere = _PREFIXES[expansion.kind], slice(None)
    sizes = expansion.intervals, len(prefixes), expansion.terms
    for interval, component, term in np.ndindex(sizes):
        index = (interval, everywhere, everywhere, component, term)
        yield f"{prefixes[component]}.{interval}.{term}", index


def _read(path: str | os.PathLike[str], header_only: bool = False) -> Any:
    """Read the channels of an EXR file, or the headers of all its parts; a table has one."""
    readable_file(path)
    try:
        with without_chatter():
            file = OpenEXR.File(str(path), separate_channels=True, header_only=header_only)
            if header_only:
                return [file.header(n) for n in range(len(file.parts))]
            return file.channels()
    except (RuntimeError, ValueError, OSError, LookupError, TypeError, MemoryError) as error:
        raise DiffractionError(
            f"cannot read '{path}' as EXR: it is empty, cut short or no EXR file; "
            "give an .exr that the command 'precompute' wrote"
        ) from error
