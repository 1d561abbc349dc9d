"""Tables of orders as NetCDF files (classic format), which most programs read.

Numbers are single precision: the first n elements of Mueller matrices (`element`), row by row; the
first is the efficiency. Over cells, the variable `kind_a_K` holds kind A of band K, with the
dimensions `tau_K`, `rho_K`, `w_K`, `j_a_K`, `q_a_K` and `element` of `Band.a`; `kind_b_K` holds
kind B. Of listed light, `efficiency` has the dimensions `wavelength`, `theta`, `phi`, `side`,
`port` and `element` of `ListedResponse.values`, with coordinate variables `wavelength` (nm, in
vacuum), `theta` and `phi` (degrees), and `order_x` and `order_y` of the ports of a side; solved
polarised light has `phase`, radians, over all of them but `element`.

Global attributes hold the rest: `period` (µm), `period_y` (of a crossed grating; else left out),
`wavelengths` (nm, in vacuum), `superstrate` (index), `thin` (1 for a sheet, whose `j` and `q` are
ports of `cells`), `block` (index of a block, with the ports of `blocks`), `even` (1 for even nodes,
else Chebyshev nodes), `index` (of the material, see `ListedResponse`), `header` (JSON), `version`,
and `sha256` of the table's digest and header.
Attributes that do not apply are left out.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import shlex
import weakref
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from ..atomic import atomic_path
from ..errors import DiffractionError, one_line
from ..files import ORDERS_ATTRIBUTE, FileKind, kind_of, read_bytes
from ..limits import MOST_EFFICIENCIES
from ..tables.fields import mapping
from ..tables.store import loaded_once
from .response import Band, CellResponse, ListedResponse
from .table import OrderTable

#: Raised whenever the meaning of the numbers changes; files of other versions are refused.
FORMAT_VERSION = 2
SUFFIX = ".nc"
_AGAIN = "solve it again with the command 'solve', or import its efficiencies again"
_LISTED, _PHASES = "efficiency", "phase"

_tables: weakref.WeakValueDictionary[str, OrderTable] = weakref.WeakValueDictionary()


def save_orders(table: OrderTable, path: str | os.PathLike[str]) -> None:
    """Write a NetCDF file; numbers are those of the table, bit by bit.

    Raises a DiffractionError if it cannot be written; no half-written file is left.
    """
    if Path(path).suffix.lower() != SUFFIX:
        raise DiffractionError(
            f"cannot write '{path}': the file name of a table of orders must end with {SUFFIX}"
        )
    content, header = io.BytesIO(), json.dumps(dict(table.header), sort_keys=True)
    with netcdf_file(content, "w") as file:
        file.title = "Efficiencies of the orders of a grating"
        file.header = header
        setattr(file, ORDERS_ATTRIBUTE, np.int32(FORMAT_VERSION))
        file.wavelengths, file.wavelengths_units = np.array(table.wavelengths), "nm"
        file.period, file.period_units = np.float64(table.periods[0]), "um"
        if table.crossed:
            file.period_y = np.float64(table.periods[1])
        file.superstrate = np.float64(table.superstrate)
        if table.thin:
            file.thin = np.int32(1)
        if table.block:
            file.block = np.float64(table.block)
        _add_response(file, table)
        file.sha256 = _checksum(table.digest(), header)
        file.flush()
        data = content.getvalue()
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def _add_response(file: Any, table: OrderTable) -> None:
    response = table.response
    if isinstance(response, ListedResponse):
        if response.index:
            file.index = np.float64(response.index)
        axes = zip(
            ("wavelength", "theta", "phi"), response.axes, ("nm", *["degree"] * 2), strict=True
        )
        for name, values, unit in axes:
            add_variable(file, name, (name,), values.astype(">f8"), unit)
        for name, column in zip(("order_x", "order_y"), response.orders.T, strict=True):
            add_variable(file, name, ("order",), column.astype(">i4"))
        every = ("wavelength", "theta", "phi", "side", "port", "element")
        add_variable(file, _LISTED, every, response.values.astype(">f4"))
        if response.phases is not None:
            add_variable(file, _PHASES, every[:-1], response.phases.astype(">f4"), "radian")
        return
    if response.even:
        file.even = np.int32(1)
    for band in response.bands:
        for kind, numbers in zip("ab", band.kinds, strict=False):
            names = (
                *(f"{axis}_{band.k}" for axis in ("tau", "rho", "w")),
                *(f"{axis}_{kind}_{band.k}" for axis in ("j", "q")),
                "element",
            )
            add_variable(file, f"kind_{kind}_{band.k}", names, numbers.astype(">f4"))


def add_variable(
    file: Any, name: str, axes: tuple[str, ...], numbers: NDArray[Any], units: str = "1"
) -> None:
    """Add a variable to an open NetCDF file, and the dimensions that the file lacks."""
    for axis, size in zip(axes, numbers.shape, strict=True):
        if axis not in file.dimensions:
            file.createDimension(axis, size)
    variable = file.createVariable(name, numbers.dtype.str, axes)
    variable[:] = numbers
    variable.units = units


def load_orders(path: str | os.PathLike[str]) -> OrderTable:
    """Read a file that `save_orders` wrote.

    Raises a DiffractionError if the file is missing, no table of orders, damaged, or of another
    version.
    """
    data = read_bytes(path)
    if kind_of(path) is not FileKind.ORDERS:
        raise DiffractionError(f"'{path}' is not a table of orders; {_advice(Path(path))}")
    try:
        with netcdf_file(io.BytesIO(data), "r", mmap=False) as file:
            version = int(getattr(file, ORDERS_ATTRIBUTE))
            if version != FORMAT_VERSION:
                raise DiffractionError(
                    f"its format version is {version}, this program reads {FORMAT_VERSION}"
                )
            return _table(file)
    except DiffractionError as error:
        raise DiffractionError(f"'{path}' is not a table of orders: {error}; {_AGAIN}") from error
    except Exception as error:  # whatever SciPy makes of damaged bytes
        raise DiffractionError(
            f"'{path}' is a damaged table of orders ({one_line(str(error))[:100]}); {_AGAIN}"
        ) from error


def loaded_orders(path: str | os.PathLike[str]) -> OrderTable:
    """Load a file once for all that use it at the same time."""
    return loaded_once(path, load_orders, _tables)


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
    for name, variable in file.variables.items():
        if np.prod(variable.shape, dtype=float) > MOST_EFFICIENCIES:
            raise ValueError(f"{name} claims {variable.shape} numbers")
    if _LISTED in file.variables:
        axes = [np.array(file.variables[name][:], float) for name in ("wavelength", "theta", "phi")]
        orders = [file.variables[name][:].astype(np.int64) for name in ("order_x", "order_y")]
        response: CellResponse | ListedResponse = ListedResponse(
            (axes[0], axes[1], axes[2]), np.column_stack(orders), _floats(file, _LISTED),
            float(file.index) if hasattr(file, "index") else None,
            _floats(file, _PHASES) if _PHASES in file.variables else None,
        )  # fmt: skip
    else:
        response = CellResponse(_bands(file), even=bool(getattr(file, "even", False)))
    header, (low, high) = file.header.decode("utf-8"), map(float, file.wavelengths)
    table = OrderTable(
        (float(file.period), float(getattr(file, "period_y", math.inf))),
        (low, high),
        response,
        float(file.superstrate),
        mapping(json.loads(header), "header"),
        bool(getattr(file, "thin", False)),
        float(file.block) if hasattr(file, "block") else None,
    )
    if file.sha256 != _checksum(table.digest(), header).encode():
        raise ValueError("its checksum is of another one")
    return table


def _floats(file: Any, name: str) -> NDArray[np.float32]:
    return np.array(file.variables[name][:], np.float32)


def _bands(file: Any) -> tuple[Band, ...]:
    numbers = sorted({int(name.rpartition("_")[2]) for name in file.variables})
    return tuple(
        Band(
            k,
            _floats(file, f"kind_a_{k}"),
            _floats(file, f"kind_b_{k}") if f"kind_b_{k}" in file.variables else None,
        )
        for k in numbers
    )


def _checksum(digest: str, header: str) -> str:
    """Return the checksum of a table's digest and header."""
    return hashlib.sha256(f"{digest}{header}".encode()).hexdigest()
