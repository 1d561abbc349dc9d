"""Tables as EXR files: named float channels for the coefficients, one JSON attribute for the rest.

A pixel is a bin; bin (0, 0), order 0, is in the middle, x runs along the rows, and the first row
holds the lowest frequency along y. The channel `power.I.T` holds term T of interval I of a power,
`re.I.T` and `im.I.T` those of an amplitude. Order 0 itself and the functions of κ that the terms of
basis "svd" are multiplied with are in the attribute, in full precision. The cells around a table of
a restricted domain are a second part of the file.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from ..atomic import atomic_path
from ..errors import DiffractionError
from .build.error import Grid
from .expansion import BASES, KINDS, Expansion
from .table import FORMAT_VERSION, DiffractionTable

#: What every EXR begins with.
EXR_BEGINS = b"\x76\x2f\x31\x01"
#: The attribute with everything but the coefficients. One string: OpenEXR keeps numbers as floats.
ATTRIBUTE = "mitsuba_diffraction"

_COMPONENTS = {"power": ("power",), "amplitude": ("re", "im")}
_PLAIN = (
    "scale",
    "spacing",
    "coherence_width",
    "coherence",
    "tolerance",
    "wavelength_range",
    "height_scale_max",
    "error",
    "source",
)


def save_table(table: DiffractionTable, path: str | os.PathLike[str]) -> None:
    """Write an EXR file: named float channels and one JSON attribute with all the rest.

    Raises
    ------
    DiffractionError
        If it cannot be written; nothing half-written is left.
    """
    if Path(path).suffix.lower() != ".exr":
        raise DiffractionError(f"cannot write '{path}': a table's file name must end with .exr")
    document = {"version": FORMAT_VERSION, **_document(table)}
    _, rows, columns, _, _ = table.coefficients.shape
    # Parts of a file must agree on it
    corners = np.array([[0, 0], [columns - 1, rows - 1]], np.int32)
    shared = {"displayWindow": (corners[0], corners[1])}
    text = json.dumps(document, default=_plain)
    parts = [_part(table, "orders", {**shared, ATTRIBUTE: text})]
    if table.coarse is not None:
        parts.append(_part(table.coarse, "coarse", shared))
    with atomic_path(path) as temporary:
        try:
            OpenEXR.File(parts).write(str(temporary))
        except RuntimeError as error:  # what OpenEXR makes of a full disk
            raise OSError(None, f"OpenEXR: {' '.join(str(error).split())}") from error


def load_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """Read a table that `save_table` wrote.

    Raises
    ------
    DiffractionError
        If the file is missing, no table, damaged, or of another format version.
    """
    document = read_document(path)
    if document is None:
        raise DiffractionError(
            f"'{path}' is an EXR image but no table; make one of it with "
            f"'mitsuba-diffraction precompute {path} -o OUT.exr', or give it as heightfield"
        )
    version = document.get("version")
    if version != FORMAT_VERSION:
        raise DiffractionError(
            f"'{path}' is a table of format version {version}, this program reads version "
            f"{FORMAT_VERSION}; build it again with 'mitsuba-diffraction precompute'"
        )
    try:
        table = _table(path, document, 0)
        if "coarse" in document:
            table = dataclasses.replace(table, coarse=_table(path, document["coarse"], 1))
        return table
    except DiffractionError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise DiffractionError(
            f"'{path}' is a damaged table ({' '.join(str(error).split())}); build it again with "
            "'mitsuba-diffraction precompute'"
        ) from error


def _document(table: DiffractionTable) -> dict[str, Any]:
    """Everything but the coefficients; what a table need not have is left out where it has not."""
    document = {
        **{name: getattr(table, name) for name in _PLAIN},
        "expansion": _given(table.expansion),
        "grid": _given(table.grid),
        "order_0": table.order_0.tolist(),
    }
    if table.crop is not None:
        document["crop"] = table.crop
    if table.coarse is not None:
        document["coarse"] = _document(table.coarse)
    return document


def _given(record: Expansion | Grid) -> dict[str, Any]:
    """Its fields, without those that are None."""
    fields = dataclasses.asdict(record)
    return {name: value for name, value in fields.items() if value is not None}


def _part(table: DiffractionTable, name: str, attributes: dict[str, Any]) -> OpenEXR.Part:
    header = {
        "name": name,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        **attributes,
    }
    channels = {
        name: np.ascontiguousarray(table.coefficients[index])
        for name, index in _channels(table.expansion)
    }
    return OpenEXR.Part(header, channels)


def _table(path: str | os.PathLike[str], document: dict[str, Any], part: int) -> DiffractionTable:
    """What `_document` describes, with the coefficients of a part of the file."""
    expansion = _expansion(document["expansion"])
    grid = Grid(**{k: _tuple(v) for k, v in dict(document["grid"]).items()})
    if grid.trims and len(grid.trims) != grid.taps[1]:
        raise ValueError(f"{len(grid.trims)} trims of {grid.taps[1]} rows")
    order_0 = np.array(document["order_0"], float)
    plain = {name: _tuple(document[name]) for name in _PLAIN}
    coefficients = _read_coefficients(path, expansion, grid, part)
    expected = (expansion.intervals, coefficients.shape[3], expansion.series_terms)
    if expansion.basis not in BASES or expansion.kind not in KINDS:
        raise ValueError(f"basis {expansion.basis!r} of {expansion.kind!r}")
    if order_0.shape != expected:
        raise ValueError(f"order_0 of shape {order_0.shape}, expected {expected}")
    return DiffractionTable(
        coefficients=coefficients,
        order_0=order_0,
        expansion=expansion,
        grid=grid,
        crop=_tuple(document.get("crop")),
        **plain,
    )


def is_table(path: str | os.PathLike[str]) -> bool:
    """Whether a file is an EXR with a table's attribute, of any version, damaged or not."""
    try:
        with open(path, "rb") as stream:
            if stream.read(len(EXR_BEGINS)) != EXR_BEGINS:
                return False
    except (OSError, ValueError):
        return False  # whoever reads it says why it cannot be
    return read_document(path) is not None


def read_document(path: str | os.PathLike[str]) -> dict[str, Any] | None:
    """The JSON attribute of a table's file, or None if the file is an EXR image without one.

    Raises
    ------
    DiffractionError
        If the file is missing, a folder, or cannot be read as EXR.
    """
    header = _read(path, lambda file: file.header(), header_only=True)
    text = header.get(ATTRIBUTE)
    if not isinstance(text, str):
        return None
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise DiffractionError(
            f"'{path}' is a damaged table (its attribute '{ATTRIBUTE}' is no JSON); build it again "
            "with 'mitsuba-diffraction precompute'"
        ) from error
    return document if isinstance(document, dict) else None


def _read_coefficients(
    path: str | os.PathLike[str], expansion: Expansion, grid: Grid, part: int
) -> NDArray[np.floating]:
    """Coefficients (intervals, ny, nx, components, terms), in the precision of the file."""
    channels = _read(path, lambda file: file.channels(part), separate_channels=True)
    shape = (2 * grid.last[1] + 1, 2 * grid.last[0] + 1)
    components = len(_COMPONENTS[expansion.kind])
    result: NDArray[np.floating] | None = None
    for name, (interval, _, _, component, term) in _channels(expansion):
        pixels = channels[name].pixels
        if pixels.shape != shape or pixels.dtype not in (np.float16, np.float32):
            raise ValueError(f"channel {name} is {pixels.dtype} {pixels.shape}, expected {shape}")
        if result is None:
            result = np.empty(
                (expansion.intervals, *shape, components, expansion.terms), pixels.dtype
            )
        result[interval, :, :, component, term] = pixels
    if result is None:
        raise ValueError("no coefficients")
    return result


def _channels(expansion: Expansion) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Channel names, and the index of each in the coefficients."""
    for interval in range(expansion.intervals):
        for component, prefix in enumerate(_COMPONENTS[expansion.kind]):
            for term in range(expansion.terms):
                everywhere = slice(None)
                index = (interval, everywhere, everywhere, component, term)
                yield f"{prefix}.{interval}.{term}", index


def _read(
    path: str | os.PathLike[str], what: Callable[[OpenEXR.File], dict[str, Any]], **options: bool
) -> dict[str, Any]:
    """Part of an EXR file."""
    if not Path(path).is_file():
        why = "it is a folder" if Path(path).is_dir() else "there is no such file"
        raise DiffractionError(f"cannot read '{path}': {why}")
    try:
        return what(OpenEXR.File(str(path), **options))
    except (RuntimeError, ValueError, OSError, LookupError) as error:
        raise DiffractionError(
            f"cannot read '{path}' as EXR: it is empty, cut short or no EXR file; "
            "give an .exr written by 'mitsuba-diffraction precompute'"
        ) from error


def _expansion(document: dict[str, Any]) -> Expansion:
    """The series, with the functions of basis "svd"."""
    if "functions" not in document:
        return Expansion(**document)
    functions = np.array(document["functions"], float)
    found = Expansion(**{**document, "functions": functions})
    if functions.ndim != 3 or functions.shape[::2] != (found.intervals, found.terms):
        raise ValueError(f"functions of shape {functions.shape}")
    return found


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    """JSON for what the table holds besides plain Python: NumPy scalars and read-only mappings."""
    if isinstance(value, Mapping):
        return dict(value)
    return value.tolist()
