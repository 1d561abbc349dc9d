"""`read_orders`: a table of orders from efficiencies of another solver, or of a bench.

The file is a long CSV with a header line and the columns

    wavelength_nm, theta_deg, phi_deg, order, R_s, R_p

one line for each propagating order of each light. The light comes from ωi = (sinθ cosφ, sinθ sinφ,
cosθ), with x along the grating vector and y along the grooves, θ and φ within the superstrate, and
order m leaves with x = mλ/d − sinθ cosφ. Wavelengths (in vacuum), θ and φ form a regular grid, and
mirrored φ (φ and −φ) need not be listed. θ below 0 is light from the other side: φ + 180°. R_s and
R_p are shares of the incident light, for light of s and of p polarisation.
"""

from __future__ import annotations

import contextlib
import csv
import math
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.spatial import QhullError

from ..errors import DiffractionError, warn
from ..files import read_text
from ..tables.orders import Band, OrderTable, cells
from ..tables.orders.table import LARGEST_SUM, Counts, check_outline
from .stations import Real

COLUMNS = ("wavelength_nm", "theta_deg", "phi_deg", "order", "R_s", "R_p")
#: Nodes of the table, to which samples are interpolated linearly.
COUNTS = Counts(12, 8, 4)
#: Distance from grazing, in p, within which rounding decides whether an order propagates.
_EDGE = 1e-6
#: Decimals of s that tell directions apart.
_DIGITS = 9


class _Samples(NamedTuple):
    """Light of the file in the coordinates of `cells`, (n,) each; efficiencies by order.

    s : x/c, which one direction has at all wavelengths.
    """

    cell: cells.Cell
    w: Real
    s: Real
    powers: list[dict[int, tuple[float, float]]]


def read_orders(
    path: str | os.PathLike[str], period: float, *, superstrate: float = 1.0
) -> OrderTable:
    """Return the table of orders of a file of efficiencies; see the module for its columns.

    Where the file has light in the plane across the grooves alone (φ = 0), conical light gets the
    efficiencies of the in-plane light with the same orders. That is exact for perfect conductors.
    Directions that the file lacks, all but one perhaps, get the efficiencies of the nearest
    direction in it, order by order. A warning says either.

    Parameters
    ----------
    path : CSV file.
    period : µm.
    superstrate : index of the medium above, to which θ and φ belong.

    Raises
    ------
    DiffractionError
        If the file cannot be read, or its grid has holes; if it has orders that do not propagate,
        or efficiencies that are negative or sum to above 1.001.
    """
    shown = f"'{os.fspath(path)}'"
    lights = _lights(path, shown)
    axes = [sorted(set(values)) for values in zip(*lights, strict=True)]
    if len(lights) < math.prod(map(len, axes)):
        hole = next(
            (a, b, c) for a in axes[0] for b in axes[1] for c in axes[2] if (a, b, c) not in lights
        )
        raise DiffractionError(
            f"{shown} has a hole: no line for {hole[0]:g} nm, theta {hole[1]:g}°, phi "
            f"{hole[2]:g}°; wavelengths and angles must form a regular grid"
        )
    wavelengths = (axes[0][0], axes[0][-1])
    check_outline(period, wavelengths, superstrate)
    samples = _samples(lights, wavelengths, superstrate * period, shown)
    in_plane = all(math.isclose(math.sin(math.radians(phi)), 0, abs_tol=1e-9) for phi in axes[2])
    last = cells.largest_band(wavelengths, superstrate * period)
    if _lacks_directions(samples, last):
        warn(
            f"{shown} has no light from some directions, which get the efficiencies of the nearest "
            "direction in it; list theta from -85 to 85 in steps of 5 or 10 to have all of them"
        )
    elif in_plane:
        warn(
            f"{shown} has light across the grooves only (phi = 0): other light gets the same "
            "efficiencies, which is exact for perfect conductors alone"
        )
    counts = Counts(*COUNTS[:2], 1 if in_plane or len(axes[0]) == 1 else COUNTS.w)
    bands = tuple(_band(k, counts, samples) for k in range(last + 1))
    header = {"solver": f"imported from {Path(path).name}", "material": "unknown",
              "profile": "unknown"}  # fmt: skip
    return OrderTable(period, wavelengths, bands, superstrate, header)


def _lights(
    path: str | os.PathLike[str], shown: str
) -> dict[tuple[float, float, float], dict[int, tuple[float, float]]]:
    """Return R_s and R_p by order, of each (wavelength, θ, φ)."""
    reader = csv.reader(read_text(path).splitlines())
    names = [name.strip() for name in next(reader, [])]
    if missing := [name for name in COLUMNS if name not in names]:
        raise DiffractionError(
            f"{shown} has no column {missing[0]}; the first line must name {', '.join(COLUMNS)}"
        )
    places = [names.index(name) for name in COLUMNS]
    lights: dict[tuple[float, float, float], dict[int, tuple[float, float]]] = {}
    for number, row in enumerate(reader, 2):
        if not row:
            continue
        try:
            lam, theta, phi, order, r_s, r_p = (float(row[place]) for place in places)
        except (ValueError, IndexError) as error:
            raise DiffractionError(
                f"{shown}, line {number}: expected numbers in {', '.join(COLUMNS)}"
            ) from error
        if not (abs(theta) < 90 and lam > 0 and order == round(order) and abs(phi) <= 360):
            raise DiffractionError(
                f"{shown}, line {number}: expected wavelength above 0, theta between -90 and 90, "
                f"phi from -360 to 360 and a whole order, got {lam:g}, {theta:g}, {phi:g}, "
                f"{order:g}"
            )
        if not (0 <= r_s <= LARGEST_SUM and 0 <= r_p <= LARGEST_SUM):
            raise DiffractionError(
                f"{shown}, line {number}: efficiencies must be 0 to 1, got {r_s:g}, {r_p:g}"
            )
        powers = lights.setdefault((lam, theta, phi), {})
        if int(order) in powers:
            raise DiffractionError(f"{shown}, line {number}: order {order:g} is listed twice")
        powers[int(order)] = (r_s, r_p)
    if not lights:
        raise DiffractionError(f"{shown} has no lines of efficiencies")
    return lights


def _samples(
    lights: dict[tuple[float, float, float], dict[int, tuple[float, float]]],
    wavelengths: tuple[float, float],
    optical_period: float,
    shown: str,
) -> _Samples:
    """Return all light in the coordinates of the table; check that its orders propagate."""
    lam, theta, phi = np.array(list(lights)).T
    sine = np.sin(np.radians(theta))
    x, y = -sine * np.cos(np.radians(phi)), sine * np.sin(np.radians(phi))
    cell = cells.to_cell(x, y, lam, optical_period)
    w = cells.w_of(cell.k_continuous, lam, wavelengths, optical_period)
    for n, ((a, b, c), powers) in enumerate(lights.items()):
        where = f"{shown}, {a:g} nm, theta {b:g}°, phi {c:g}°"
        # order m lies at p − m, which 0 to K hold
        step, room = a / (1e3 * optical_period), math.sqrt(1.0 - y[n] ** 2)
        highest, lowest = (room - x[n]) / step, (-room - x[n]) / step
        if extra := [m for m in powers if not lowest - _EDGE <= m <= highest + _EDGE]:
            raise DiffractionError(f"{where}: order {extra[0]} does not propagate; check --period")
        needed = range(math.ceil(lowest + _EDGE), math.floor(highest - _EDGE) + 1)
        if lost := [m for m in needed if m not in powers]:
            raise DiffractionError(f"{where}: order {lost[0]} propagates, and has no line")
        for values in zip(*powers.values(), strict=True):
            if sum(values) > LARGEST_SUM:
                raise DiffractionError(
                    f"{where}: the orders sum to {sum(values):.4g}, above {LARGEST_SUM}"
                )
    s = np.round(x / np.sqrt(1.0 - y * y), _DIGITS)
    return _Samples(cell, w, s, list(lights.values()))


def _lacks_directions(samples: _Samples, last: int) -> bool:
    """Whether some set of orders propagates in no light of the file, though its band is listed."""
    cell = samples.cell
    present = set(zip(cell.band.tolist(), cell.kind.tolist(), cell.channel.tolist(), strict=True))
    return any(
        (k, kind, j) not in present
        for k in range(int(cell.band.min()), last + 1)
        for kind in ((cells.A, cells.B) if k else (cells.A,))
        for j in range(k + 1 - kind)
    )


def _band(k: int, counts: Counts, samples: _Samples) -> Band:
    """Interpolate a band, each segment between kinks from its own samples."""
    kinds = (cells.A, cells.B) if k else (cells.A,)
    return Band(k, *(_kind(k, kind, counts, samples) for kind in kinds))


def _kind(k: int, kind: int, counts: Counts, samples: _Samples) -> NDArray[np.float32]:
    size, axes = k + 1 - kind, 2 if counts.w == 1 else 3
    grid = np.meshgrid(*(cells.nodes(count) for count in counts), indexing="ij")
    places = np.stack(grid, axis=-1)[..., :axes]
    values = np.zeros((*counts, size, size, 2))
    cell = samples.cell
    coordinates = np.stack([cell.tau, cell.rho, samples.w], axis=-1)[:, :axes]
    several = len(np.unique(samples.s)) > 1
    for j in range(size):
        here = np.flatnonzero((cell.band == k) & (cell.kind == kind) & (cell.channel == j))
        if k < cell.band.min():
            # nearer to the grooves' direction than all light of the file: a mirror
            values[:, :, :, j, j] = _mean_sum(samples, int(cell.band.min()))
        elif len(here) and several:
            known = [[samples.powers[n].get(j - q, (0.0, 0.0)) for q in range(size)] for n in here]
            values[:, :, :, j] = _interpolated(coordinates[here], np.array(known), places)
        else:
            big_k = k + cells.sine_squared(grid[1])
            s = cells.from_cell(k, kind, j, grid[0], grid[1], 2e3 / big_k, 1.0).x  # at c = 1
            for q in range(size):
                values[:, :, :, j, q] = _of_nearest_direction(samples, j - q, s, big_k)
    return values.astype(np.float32)


def _of_nearest_direction(samples: _Samples, order: int, s: Real, big_k: Real) -> Real:
    """Return the efficiency of an order in the light of the file nearest in s, at the same K.

    s, big_k : of one shape (…). Returns (…, 2), of s and p.
    """
    listed = np.unique(samples.s)
    nearest = np.abs(s[..., None] - listed).argmin(axis=-1)
    values = np.zeros((*s.shape, 2))
    for number in np.unique(nearest):
        light = np.flatnonzero(samples.s == listed[number])
        light = light[np.argsort(samples.cell.k_continuous[light])]
        powers = np.array([samples.powers[n].get(order, (0.0, 0.0)) for n in light])
        here = nearest == number
        for polarisation in (0, 1):
            values[here, polarisation] = np.interp(
                big_k[here], samples.cell.k_continuous[light], powers[:, polarisation]
            )
    return values


def _mean_sum(samples: _Samples, band: int) -> Real:
    """Return the mean sum over orders of a band, for s and p, (2,)."""
    here = np.flatnonzero(samples.cell.band == band)
    sums = [np.sum(list(samples.powers[n].values()), axis=0) for n in here]
    return np.asarray(np.mean(sums, axis=0))


def _interpolated(points: Real, values: Real, places: Real) -> Real:
    """Interpolate values (n, …) at points (n, axes) linearly; outside of them, the nearest."""
    flat = values.reshape(len(values), -1)
    result = NearestNDInterpolator(points, flat)(places)
    with contextlib.suppress(QhullError):  # too few points, or all on a line
        linear = LinearNDInterpolator(points, flat)(places)
        result = np.where(np.isnan(linear), result, linear)
    return np.asarray(result).reshape(*places.shape[:-1], *values.shape[1:])
