"""Tables of orders as NetCDF files (classic format), which most programs read.

The variable `kind_a_K` holds kind A of band K, with the dimensions `tau_K`, `rho_K`, `w_K`, `j`,
`q` and `polarisation` of `Band.a`; `kind_b_K` holds kind B. The Mueller matrices of a
polarised table are `mueller_a_K` and `mueller_b_K`, with `row` and `column` for `polarisation`.
Numbers are packed in 16 bits, as the CF conventions have it: efficiency = scale_factor × number.
Global attributes hold the rest: `period` (µm), `wavelengths` (nm, in vacuum), `superstrate`
(index), `thin` (1 for a sheet, whose `j` and `q` are ports of `cells`; else left out), `block`
(index, with even nodes and the ports of `blocks`; else left out), `components` (of `polarisation`,
"s and p" of imported efficiencies; else left out), `header` (JSON), `version`, and `sha256` of all
of these and the numbers.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...errors import DiffractionError, one_line
from ...files import ORDERS_ATTRIBUTE, FileKind, kind_of, read_bytes
from ...limits import MOST_EFFICIENCIES
from ..fields import mapping
from .crossed import CrossedTable
from .table import GROOVES, Band, OrderTable

#: Raised whenever the meaning of the numbers changes; files of another version are refused.
FORMAT_VERSION = 1
SUFFIX = ".nc"
#: Step of the packed efficiencies: 16 bits reach 1.092.
_STEP = 1.0 / 30_000.0
#: Mark of Mueller matrices among packed arrays.
_MUELLER = " mueller"
#: Attribute of tables of crossed gratings.
_CROSSED = "crossed"
_AGAIN = "solve it again (the command 'solve', or solve_orders)"


def save_orders(table: OrderTable, path: str | os.PathLike[str]) -> None:
    """Write a NetCDF file; efficiencies are rounded to 1/30000 of the incident light.

    Raises a DiffractionError if it cannot be written; no half-written file is left.
    """
    packed = {
        (band.k, kind + part): np.rint(values / _STEP).astype(">i2")
        for band in table.bands
        for part, arrays in (("", band.kinds), (_MUELLER, band.mueller or ()))
        for kind, values in zip("ab", arrays, strict=False)
    }
    with _written(path, "Efficiencies of the orders of a grating", table) as file:
        file.period, file.period_units = np.float64(table.period), "um"
        file.superstrate = np.float64(table.superstrate)
        if table.thin:
            file.thin = np.int32(1)
        if table.block:
            file.block = np.float64(table.block)
        if table.components != GROOVES:
            file.components = table.components
        file.sha256 = _checksum(_outline(file), packed)
        for (k, part), numbers in packed.items():
            kind, matrices = part[0], part.endswith(_MUELLER)
            names = [f"{axis}_{k}" for axis in ("tau", "rho", "w")]
            names += [f"{axis}_{kind}_{k}" for axis in ("j", "q")]
            names += ["row", "column"] if matrices else ["polarisation"]
            first = "mueller" if matrices else "kind"
            _add(file, f"{first}_{kind}_{k}", names, numbers)


def save_crossed(table: CrossedTable, path: str | os.PathLike[str]) -> None:
    """Write a NetCDF file with the variable `efficiency` over wavelength, y, x, order_y, order_x.

    Rounding and errors as of `save_orders`.
    """
    with _written(path, "Efficiencies of the orders of a crossed grating", table) as file:
        setattr(file, _CROSSED, np.int32(1))
        file.periods, file.periods_units = np.array(table.periods), "um"
        numbers = np.rint(table.values / _STEP).astype(">i2")
        _add(file, "efficiency", ("wavelength", "y", "x", "order_y", "order_x"), numbers)
        file.sha256 = _crossed_checksum(file, numbers)


@contextlib.contextmanager
def _written(
    path: str | os.PathLike[str], title: str, table: OrderTable | CrossedTable
) -> Iterator[Any]:
    """Give a file with what all tables have, and write it in one piece at the end."""
    if Path(path).suffix.lower() != SUFFIX:
        raise DiffractionError(
            f"cannot write '{path}': the file name of a table of orders must end with {SUFFIX}"
        )
    content = io.BytesIO()
    with scipy.io.netcdf_file(content, "w") as file:
        file.title, file.header = title, json.dumps(dict(table.header), sort_keys=True)
        setattr(file, ORDERS_ATTRIBUTE, np.int32(FORMAT_VERSION))
        file.wavelengths, file.wavelengths_units = np.array(table.wavelengths), "nm"
        yield file
        file.flush()
        data = content.getvalue()
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def _add(file: Any, name: str, axes: Sequence[str], numbers: NDArray[np.int16]) -> None:
    """Add packed efficiencies, and the dimensions that the file lacks."""
    for axis, size in zip(axes, numbers.shape, strict=True):
        if axis not in file.dimensions:
            file.createDimension(axis, size)
    variable = file.createVariable(name, ">i2", axes)
    variable[:] = numbers
    variable.scale_factor, variable.units = np.float64(_STEP), "1"


def load_orders(path: str | os.PathLike[str]) -> OrderTable:
    """Read a file that `save_orders` wrote.

    Raises a DiffractionError if the file is missing, no table of orders, damaged, of another
    version, or of a crossed grating.
    """
    table = load_any_orders(path)
    if isinstance(table, CrossedTable):
        raise DiffractionError(
            f"'{path}' is a table of a crossed grating, which is shown by Mitsuba alone, read by "
            "CrossedTable.load, and listed by the command 'orders'; give a table of grooves here"
        )
    return table


def load_crossed(path: str | os.PathLike[str]) -> CrossedTable:
    """Read a file that `CrossedTable.save` wrote.

    Raises a DiffractionError as `load_orders` does, and for a table of grooves.
    """
    table = load_any_orders(path)
    if isinstance(table, CrossedTable):
        return table
    raise DiffractionError(f"'{path}' is a table of grooves; read it by OrderTable.load")


def load_any_orders(path: str | os.PathLike[str]) -> OrderTable | CrossedTable:
    """Read a file that `save_orders` or `CrossedTable.save` wrote.

    Raises a DiffractionError if the file is missing, no table of orders, damaged, or of another
    version.
    """
    data = read_bytes(path)
    if kind_of(path) is not FileKind.ORDERS:
        raise DiffractionError(f"'{path}' is not a table of orders; {_advice(Path(path))}")
    try:
        with scipy.io.netcdf_file(io.BytesIO(data), "r", mmap=False) as file:
            version = int(getattr(file, ORDERS_ATTRIBUTE))
            if version != FORMAT_VERSION:
                raise DiffractionError(
                    f"its format version is {version}, this program reads {FORMAT_VERSION}"
                )
            return _crossed(file) if hasattr(file, _CROSSED) else _table(file)
    except DiffractionError as error:
        raise DiffractionError(f"'{path}' is not a table of orders: {error}; {_AGAIN}") from error
    except Exception as error:  # whatever SciPy makes of damaged bytes
        raise DiffractionError(
            f"'{path}' is a damaged table of orders ({one_line(str(error))[:100]}); {_AGAIN}"
        ) from error


def _advice(path: Path) -> str:
    """Return the remedy for a file of another kind than a table of orders."""
    if kind_of(path) is FileKind.RECIPE:
        return (
            f"run the command 'solve {shlex.quote(str(path))}', and give the table (.nc) that it "
            "writes"
        )
    if kind_of(path) is FileKind.TABLE:
        return "tables of heights (EXR) belong to the BSDF 'diffraction'"
    return (
        "make one with the command 'solve' (solve_orders), or of efficiencies of other programs "
        "with 'solve --import' (read_orders)"
    )


def _table(file: Any) -> OrderTable:
    """Return the table of an open file."""
    outline = _outline(file)
    header = mapping(json.loads(outline["header"]), "header")
    packed: dict[tuple[int, str], NDArray[np.int16]] = {}
    unpacked: dict[tuple[int, str], NDArray[np.float32]] = {}
    for name, variable in file.variables.items():
        first, kind, k = name.split("_")
        if np.prod(variable.shape, dtype=float) > MOST_EFFICIENCIES:
            raise ValueError(f"{name} claims {variable.shape} numbers")
        key = int(k), kind + (_MUELLER if first == "mueller" else "")
        packed[key] = variable[:]
        scale = file.variables[f"kind_{kind}_{k}"].scale_factor
        unpacked[key] = (packed[key] * scale).astype(np.float32)
    if file.sha256 != _checksum(outline, packed).encode():
        raise ValueError("its checksum is of another one")
    bands = tuple(_band(k, unpacked) for k in sorted({k for k, _ in unpacked}))
    return OrderTable(**{**outline, "bands": bands, "header": header})


def _band(k: int, arrays: dict[tuple[int, str], NDArray[np.float32]]) -> Band:
    matrices = [arrays[k, kind + _MUELLER] for kind in "ab" if (k, kind + _MUELLER) in arrays]
    return Band(k, arrays[k, "a"], arrays.get((k, "b")), mueller=tuple(matrices) or None)


def _outline(file: Any) -> dict[str, Any]:
    """Return the attributes of an open file as arguments of `OrderTable`; the header as text."""
    return {
        "period": float(file.period),
        "wavelengths": tuple(map(float, file.wavelengths)),
        "superstrate": float(file.superstrate),
        "header": _text(file.header),
        "thin": bool(getattr(file, "thin", False)),
        "components": _text(getattr(file, "components", GROOVES)),
        "block": float(file.block) if hasattr(file, "block") else None,
    }


def _text(attribute: str | bytes) -> str:
    """Return an attribute of a file that is written, or read: bytes then."""
    return attribute if isinstance(attribute, str) else attribute.decode("utf-8")


def _checksum(outline: dict[str, Any], packed: dict[tuple[int, str], NDArray[np.int16]]) -> str:
    """Return the checksum of a file's outline and numbers."""
    *always, thin, components, block = outline.values()
    content = hashlib.sha256(repr(tuple(always)).encode())
    if thin:
        content.update(b"thin")
    if components != GROOVES:
        content.update(components.encode())
    if block:
        content.update(repr(("block", block)).encode())
    for key in sorted(packed):
        content.update(repr((key, packed[key].shape)).encode())
        content.update(np.ascontiguousarray(packed[key], ">i2").data)
    return content.hexdigest()


def _crossed(file: Any) -> CrossedTable:
    """Return the table of a crossed grating of an open file."""
    variable = file.variables["efficiency"]
    if np.prod(variable.shape, dtype=float) > MOST_EFFICIENCIES:
        raise ValueError(f"it claims {variable.shape} numbers")
    if file.sha256 != _crossed_checksum(file, variable[:]).encode():
        raise ValueError("its checksum is of another one")
    values = (variable[:] * variable.scale_factor).astype(np.float32)
    (d_x, d_y), (low, high) = map(float, file.periods), map(float, file.wavelengths)
    header = mapping(json.loads(file.header), "header")
    return CrossedTable((d_x, d_y), (low, high), values, header)


def _crossed_checksum(file: Any, numbers: NDArray[Any]) -> str:
    content = hashlib.sha256(_text(file.header).encode())
    for part in (file.periods, file.wavelengths):
        content.update(np.asarray(part, ">f8").tobytes())
    content.update(np.ascontiguousarray(numbers, ">i2").data)
    return content.hexdigest()
