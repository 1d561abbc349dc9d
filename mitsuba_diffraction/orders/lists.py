"""Files of efficiencies of another solver, or of a bench: long CSV, and NetCDF.

A CSV has a header line and the columns

    wavelength_nm, theta_deg, phi_deg, order, R_s, R_p [, T_s, T_p]

one line for each propagating order of each light. A NetCDF file, classic or version 4 (HDF5), has
the variables R_s, R_p [, T_s, T_p] over the dimensions wavelength, theta, phi and order, in any
order, with a coordinate variable each; `units` of coordinates are nm (default), um or m, and
degrees (default) or radians; of efficiencies 1 (default) or %. The column or dimension of φ may be
missing: φ = 0.

A crossed grating has the columns, or dimensions, order_x and order_y in place of order.

The light comes from ωi = (sinθ cosφ, sinθ sinφ, cosθ), with x along the grating vector and y along
the grooves, θ and φ within the superstrate, and order m leaves with x = mλ/d − sinθ cosφ; order
(m_x, m_y) of a crossed grating with y = m_y λ/d_y − sinθ sinφ as well. Wavelengths (in vacuum), θ
and φ form a regular grid, and mirrored φ (φ and −φ) of grooves need not be listed. θ below 0 is
light from the other side: φ + 180°. R and T are reflected and transmitted shares of the incident
light, for light of s and of p polarisation. T is transmitted by a thin sheet.
"""

from __future__ import annotations

import io
import os
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from ..arrays import Real
from ..columns import WAVELENGTH_UNITS, read_columns
from ..errors import DiffractionError, one_line, quoted, warn
from ..extras import optional
from ..files import FileKind, beginning, kind_of, read_bytes
from ..limits import MOST_EFFICIENCIES, bounded_memory, check_content
from .listed import Lights
from .response import LARGEST_SUM
from .table import WAVELENGTHS

AXES = ("wavelength", "theta", "phi", "order")
REFLECTED, TRANSMITTED = ("R_s", "R_p"), ("T_s", "T_p")
CSV_AXES = ("wavelength_nm", "theta_deg", "phi_deg", "order")
#: Columns of a crossed grating, instead of the last one.
PAIR = ("order_x", "order_y")
#: Largest |order| in a list: of a period of 100 µm at 200 nm.
MOST_ORDER = 1000
#: Light below which an efficiency is 0 but for a solver's rounding, negative ones too.
ROUNDING = 1e-6
_ANGLES = {"deg": 1.0, "degree": 1.0, "°": 1.0, "rad": 180.0 / np.pi, "radian": 180.0 / np.pi}
_UNITS: dict[str, dict[str, float]] = {
    "wavelength": WAVELENGTH_UNITS | {"meter": 1e9}, "theta": _ANGLES, "phi": _ANGLES,
    **{axis: {"1": 1.0} for axis in ("order", *PAIR)},
}  # fmt: skip
_PER_CENT = ("%", "percent", "per cent")
_BEGINS_HDF5 = b"\x89HDF\r\n\x1a\n"


class Variable(NamedTuple):
    """Variable of a NetCDF file: names of its dimensions, numbers, and units ("" if unknown)."""

    dimensions: tuple[str, ...]
    values: Real
    units: str


def axes_of(names: Collection[str]) -> tuple[str, ...]:
    """Return the dimensions of efficiencies, by the columns or variables that there are."""
    return AXES if set(PAIR).isdisjoint(names) else (*AXES[:3], *PAIR)


def read_efficiencies(path: str | os.PathLike[str]) -> Lights:
    """Read a file of efficiencies; see the module.

    Values of the lights are (a, b, c, m, 2) reflected, or (a, b, c, m, 4) reflected and transmitted
    shares of light of s and of p polarisation; NaN where the file has none.

    Raises a DiffractionError if the file cannot be read, lacks a column or variable, has an unknown
    unit, a hole in its grid, an order twice, or numbers out of range.
    """
    shown = repr(os.fspath(path))
    head = beginning(path, len(_BEGINS_HDF5))
    if kind_of(path) is FileKind.ORDERS:
        raise DiffractionError(f"{shown} is a table of orders already; use it as it is")
    if head.startswith(b"CDF") or head == _BEGINS_HDF5:
        try:
            variables = _hdf5(path) if head == _BEGINS_HDF5 else _classic(path)
        except DiffractionError:
            raise
        except Exception as error:  # whatever a library makes of damaged bytes
            raise DiffractionError(
                f"{shown} is a damaged NetCDF file ({one_line(str(error))[:100]}); write it again"
            ) from error
        grid = _of_variables(variables, shown)
    else:
        grid = _of_lines(path, shown)
    _check(grid, shown)
    return grid


def _of_lines(path: str | os.PathLike[str], shown: str) -> Lights:
    """Return the grid of a text of columns with names."""
    columns = read_columns(path)
    if not len(columns.numbers):
        raise DiffractionError(f"{shown} has no lines of efficiencies")
    kinds = _kinds(list(columns.names), shown, "column")
    axes = [name for name in CSV_AXES[:3] if name != "phi_deg" or name in columns.names]
    axes += axes_of(columns.names)[3:]
    table = columns.of((*axes, *kinds))
    if "phi_deg" not in axes:
        table = np.insert(table, 2, 0.0, axis=1)
    lights, powers = np.split(table, [-len(kinds)], axis=1)
    return _regular(lights, powers, shown)


def _of_variables(variables: dict[str, Variable], shown: str) -> Lights:
    """Return the grid of a NetCDF file's variables."""
    kinds = _kinds(list(variables), shown, "variable")
    every = axes_of(variables)
    given = variables[kinds[0]].dimensions
    dimensions = [axis for axis in every if axis != "phi" or "phi" in given]
    axes = {"phi": np.zeros(1)}
    for axis in dimensions:
        if axis not in variables or variables[axis].dimensions != (axis,):
            raise DiffractionError(
                f"{shown} has no coordinate variable {axis}({axis}), which says where the "
                "efficiencies are"
            )
        axes[axis] = variables[axis].values * _factor(axis, variables[axis].units, shown)
    _check_size([len(axes[axis]) for axis in every], len(kinds), shown)
    powers = []
    for kind in kinds:
        variable = variables[kind]
        if sorted(variable.dimensions) != sorted(dimensions):
            raise DiffractionError(
                f"{shown}: {kind} has the dimensions {', '.join(variable.dimensions) or 'none'}; "
                f"expected {', '.join(every)} (phi may be missing)"
            )
        values = variable.values.transpose([variable.dimensions.index(d) for d in dimensions])
        scale = 0.01 if variable.units.strip().lower() in _PER_CENT else 1.0
        powers.append(scale * values.ravel())
    if unknown := [axis for axis in dimensions if axis in AXES[:3] and not variables[axis].units]:
        warn(
            f"{shown}: {', '.join(unknown)} without units: wavelengths are taken to be in nm, "
            "angles in degrees"
        )
    lights = np.meshgrid(*(axes[axis] for axis in every), indexing="ij")
    columns = np.column_stack([part.ravel() for part in lights])
    return _regular(columns, np.column_stack(powers), shown)


def _regular(lights: Real, powers: Real, shown: str) -> Lights:
    """Put lines on the grid that they form.

    lights : (n, 4) coordinates, or (n, 5) of a crossed grating, as `axes_of` has them.
    powers : (n, 2) or (n, 4) efficiencies.
    """
    check_light(lights[:, 0], lights[:, 1], lights[:, 2], shown)
    numbers = lights[:, 3:].ravel()
    whole = (numbers == np.round(numbers)) & (np.abs(numbers) <= MOST_ORDER)
    _check_all("order", numbers, whole, f"a whole number of at most {MOST_ORDER}", shown)
    axes, places = zip(
        *(np.unique(column, return_inverse=True) for column in lights.T[:3]), strict=True
    )
    orders, column = np.unique(lights[:, 3:].astype(np.int64), axis=0, return_inverse=True)
    shape = (*map(len, axes), len(orders))
    light = np.ravel_multi_index(places, shape[:3])
    listed = np.unique(light)
    if len(listed) < np.prod(shape[:3], dtype=float):
        holes = np.flatnonzero(listed != np.arange(len(listed)))
        hole = np.unravel_index(holes[0] if len(holes) else len(listed), shape[:3])
        lam, theta, phi = (axis[place] for axis, place in zip(axes, hole, strict=True))
        raise DiffractionError(
            f"{shown} has a hole: no line for {lam:g} nm, theta {theta:g}°, phi {phi:g}°; "
            "wavelengths and angles must form a regular grid"
        )
    _check_size(shape, powers.shape[1], shown)
    values = np.full((*shape, powers.shape[1]), np.nan)
    crossed = orders.shape[1] == 2
    pairs = orders if crossed else np.insert(orders, 1, 0, axis=1)
    grid = Lights(axes[0], axes[1], axes[2], pairs, values, crossed)
    place = light * shape[3] + column.ravel()
    found, counts = np.unique(place, return_counts=True)
    if (counts > 1).any():
        twice = int(found[counts > 1][0])
        raise DiffractionError(
            f"{shown}, {grid.light(twice // shape[3])}: order {grid.order(twice % shape[3])} is "
            "listed twice"
        )
    values.reshape(-1, powers.shape[1])[place] = powers
    return grid


def _kinds(names: list[str], shown: str, what: str) -> tuple[str, ...]:
    """Return the efficiencies that a file has: reflected, or reflected and transmitted."""
    kinds: tuple[str, ...] = REFLECTED
    if any(name in names for name in TRANSMITTED):
        kinds = (*REFLECTED, *TRANSMITTED)
    if missing := [name for name in kinds if name not in names]:
        raise DiffractionError(
            f"{shown} has no {what} {missing[0]}, the share of light of {missing[0][-1]} "
            f"polarisation (s is TE in light across the grooves); list unpolarised shares as both"
        )
    return kinds


def _factor(axis: str, units: str, shown: str) -> float:
    """Return the nm, or degrees, of a unit."""
    known = _UNITS[axis]
    name = units.strip().lower()
    factor = known.get(name, known.get(name.removesuffix("s")))
    if factor is None and name:
        raise DiffractionError(
            f"{shown}: the units of {axis} are {quoted(units)}; known are {', '.join(known)}"
        )
    return 1.0 if factor is None else factor


def _classic(path: str | os.PathLike[str]) -> dict[str, Variable]:
    """Read the variables of a classic NetCDF file."""
    with netcdf_file(io.BytesIO(read_bytes(path)), "r", mmap=False) as file:
        return {
            name: _variable(variable.dimensions, variable[:], variable._attributes)
            for name, variable in file.variables.items()
            if name in (*AXES, *PAIR, *REFLECTED, *TRANSMITTED)
        }


def _hdf5(path: str | os.PathLike[str]) -> dict[str, Variable]:
    """Read the variables of a NetCDF file of version 4."""
    h5py = optional("h5py", repr(os.fspath(path)))
    variables, claimed, shown = {}, 0.0, repr(os.fspath(path))
    with bounded_memory(size := os.path.getsize(path), shown), h5py.File(path, "r") as file:
        for name in (*AXES, *PAIR, *REFLECTED, *TRANSMITTED):
            if name not in file:
                continue
            data = file[name]
            claimed += 8.0 * data.size
            check_content(claimed, size, shown)
            scales = [dimension[0].name.rpartition("/")[2] for dimension in data.dims if dimension]
            dimensions = [name] if data.is_scale else scales
            variables[name] = _variable(dimensions, data[()], data.attrs)
    return variables


def _variable(dimensions: Any, values: Any, attributes: Any) -> Variable:
    """Return a variable with its numbers unpacked, as the CF conventions have it."""
    numbers = np.asarray(values, np.float64)
    if (missing := attributes.get("_FillValue")) is not None:
        numbers = np.where(numbers == float(np.squeeze(missing)), np.nan, numbers)
    scale, offset = (
        float(np.squeeze(attributes.get(name, default)))
        for name, default in (("scale_factor", 1.0), ("add_offset", 0.0))
    )
    units = attributes.get("units", "")
    text = units.decode("utf-8") if isinstance(units, bytes) else str(units)
    return Variable(tuple(map(str, dimensions)), numbers * scale + offset, text)


def check_light(wavelengths: Real, theta: Real, phi: Real, shown: str) -> None:
    """Check the ranges of wavelengths (nm) and angles (degrees).

    shown : source of the numbers, for the message.
    """
    low, high = WAVELENGTHS
    for name, numbers, allowed, hint in (
        ("wavelength", wavelengths, (wavelengths >= low) & (wavelengths <= high),
         f"{low:g} to {high:g} nm; is the unit right?"),
        ("theta", theta, np.abs(theta) < 90, "above -90° and below 90°"),
        ("phi", phi, np.abs(phi) <= 360, "-360° to 360°"),
    ):  # fmt: skip
        _check_all(name, numbers, allowed, hint, shown)


def _check_all(name: str, numbers: Real, allowed: NDArray[np.bool_], hint: str, shown: str) -> None:
    if not allowed.all():  # NaN is not allowed either
        raise DiffractionError(f"{shown}: {name} {numbers[~allowed][0]:g} must be {hint}")


def _check_size(shape: Sequence[int], kinds: int, shown: str) -> None:
    """Refuse grids that are too large, or empty."""
    size = np.prod(shape, dtype=float) * kinds
    if not 0 < size <= MOST_EFFICIENCIES:
        raise DiffractionError(
            f"{shown} has {' x '.join(map(str, shape))} wavelengths, theta, phi and orders; a "
            f"table may be made of 1 to {MOST_EFFICIENCIES} efficiencies: list fewer"
        )


def _check(grid: Lights, shown: str) -> None:
    """Check the range of efficiencies."""
    wrong = ~np.isnan(grid.values) & ~((grid.values >= -ROUNDING) & (grid.values <= LARGEST_SUM))
    if wrong.any():
        *light, order, _ = np.argwhere(wrong)[0]
        where = grid.light(int(np.ravel_multi_index(light, grid.values.shape[:3])))
        raise DiffractionError(
            f"{shown}, {where}, order {grid.order(order)}: efficiencies must be 0 to 1, got "
            f"{grid.values[wrong][0]:g}; they are shares of the incident light, no per cent"
        )
