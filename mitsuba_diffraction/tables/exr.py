"""Tables as EXR files: named float channels for the coefficients, one JSON attribute for the rest.

A pixel is a bin; bin (0, 0), order 0, is in the middle, x runs along the rows, and the first row
holds the lowest frequency along y. The channel `power.I.T` holds term T of interval I of a power,
`re.I.T` and `im.I.T` the parts of an amplitude. Order 0 itself and the functions of κ that the
terms of basis "svd" are multiplied with are in the attribute, in full precision. A second attribute
has the SHA-256 of the rest of the file.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from ..atomic import atomic_path
from ..errors import DiffractionError, one_line, quoted
from ..files import TABLE_ATTRIBUTE, readable_file
from ..streams import without_chatter
from .document import TableDescription, document_of, parse_document, plain
from .expansion import Expansion
from .table import FORMAT_VERSION, DiffractionTable

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
    write_exr(path, channels, header)


def write_exr(
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
            OpenEXR.File(header, contiguous).write(str(temporary))
        except RuntimeError as error:  # OpenEXR's exception for a full disk
            raise OSError(None, f"OpenEXR: {one_line(str(error))}") from error


def load_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """Read a table that `save_table` wrote.

    Raises a DiffractionError if the file is missing, no table, damaged, or of another format
    version.
    """
    headers = _headers(path)
    text = headers[0].get(TABLE_ATTRIBUTE)
    document = _parsed(text, path)
    if document is None:
        raise DiffractionError(
            f"'{path}' is an EXR image but no table; make one of it with "
            "DiffractionTable.build, or give it as heightfield"
        )
    version = document.pop("version", None)
    if version != FORMAT_VERSION:
        raise DiffractionError(
            f"'{path}' is a table of format version {quoted(version)}, this program reads version "
            f"{FORMAT_VERSION}; build it again with DiffractionTable.build"
        )
    try:
        description = parse_document(document)
        _check_headers(headers, description, os.path.getsize(path))
        planes = _planes(_read(path, lambda file: file.channels()), description)
        if headers[0].get(CHECKSUM) != _checksum(str(text), planes):
            raise ValueError("its checksum is of another one")
        return description.table(_coefficients(planes, description))
    except (DiffractionError, ValueError, MemoryError) as error:
        raise DiffractionError(
            f"'{path}' is a damaged table ({one_line(str(error))[:200]}); build it again with "
            "DiffractionTable.build"
        ) from error


def read_document(path: str | os.PathLike[str]) -> dict[str, Any] | None:
    """Return the JSON attribute of a table's file; None for an EXR image without one.

    Raises a DiffractionError if the file is missing, a folder, or cannot be read as EXR.
    """
    return _parsed(_headers(path)[0].get(TABLE_ATTRIBUTE), path)


def _parsed(text: Any, path: str | os.PathLike[str]) -> dict[str, Any] | None:
    if not isinstance(text, str):
        return None
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DiffractionError(
            f"'{path}' is a damaged table (its attribute '{TABLE_ATTRIBUTE}' is no JSON); build it "
            "again with DiffractionTable.build"
        ) from error
    return document if isinstance(document, dict) else None


def _check_headers(headers: list[dict[str, Any]], expected: TableDescription, size: int) -> None:
    """Refuse a file that is not one image as described, before its pixels are read."""
    if len(headers) != 1:
        raise ValueError(f"{len(headers)} parts, expected one")
    header = headers[0]
    _, rows, columns, _, _ = expected.shape
    low, high = header["dataWindow"]
    window = [*low.tolist(), *high.tolist()]
    if window != [0, 0, columns - 1, rows - 1] or header["type"] != OpenEXR.scanlineimage:
        raise ValueError(f"pixels {window}, expected {columns} x {rows}")
    names = sorted((c.name, c.xSampling, c.ySampling) for c in header["channels"])
    if names != sorted((name, 1, 1) for name, _ in _channels(expected.fields["expansion"])):
        raise ValueError(f"{len(names)} channels other than those of its terms")
    claimed = 2 * int(np.prod(expected.shape))
    if claimed > max(_SMALL, _BEST_COMPRESSION * size):
        raise ValueError(f"{size} bytes that claim to hold {claimed:.2g}")


def _planes(
    channels: Mapping[str, Any], expected: TableDescription
) -> dict[str, NDArray[np.floating]]:
    """Return the pixels of each channel, in the order of `_channels`."""
    expansion = expected.fields["expansion"]
    planes = {name: channels[name].pixels for name, _ in _channels(expansion)}
    kinds = {plane.dtype for plane in planes.values()}
    if len(kinds) > 1 or not kinds <= {np.dtype(np.float16), np.dtype(np.float32)}:
        raise ValueError(f"channels of {', '.join(sorted(map(str, kinds)))}")
    return planes


def _coefficients(
    planes: Mapping[str, NDArray[np.floating]], expected: TableDescription
) -> NDArray[np.floating]:
    """Return coefficients (intervals, ny, nx, components, terms), in the precision of the file."""
    names = list(_channels(expected.fields["expansion"]))
    result = np.empty(expected.shape, planes[names[0][0]].dtype)
    for name, index in names:
        result[index] = planes[name]
    return result


def _checksum(text: str, planes: Mapping[str, NDArray[np.floating]]) -> str:
    content = hashlib.sha256(text.encode())
    for plane in planes.values():
        content.update(np.ascontiguousarray(plane).data)
    return content.hexdigest()


def _channels(expansion: Expansion) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield channel names, and the index of each in the coefficients."""
    for interval in range(expansion.intervals):
        for component, prefix in enumerate(_PREFIXES[expansion.kind]):
            for term in range(expansion.terms):
                everywhere = slice(None)
                index = (interval, everywhere, everywhere, component, term)
                yield f"{prefix}.{interval}.{term}", index


def _headers(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Read the headers of all parts of an EXR file; a table has one."""
    return _read(
        path, lambda file: [file.header(n) for n in range(len(file.parts))], header_only=True
    )


def _read(
    path: str | os.PathLike[str], read: Callable[[OpenEXR.File], Any], header_only: bool = False
) -> Any:
    """Read a part of an EXR file."""
    readable_file(path)
    try:
        with without_chatter():
            return read(OpenEXR.File(str(path), separate_channels=True, header_only=header_only))
    except (RuntimeError, ValueError, OSError, LookupError, TypeError, MemoryError) as error:
        raise DiffractionError(
            f"cannot read '{path}' as EXR: it is empty, cut short or no EXR file; "
            "give an .exr written by DiffractionTable.save"
        ) from error
