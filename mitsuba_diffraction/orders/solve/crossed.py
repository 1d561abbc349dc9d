"""`solve_crossed`: orders of a crossed grating by coupled waves in two dimensions (ikarus-rcwa).

Moharam et al. 1995 (JOSA A 12, 1068), Li 1997 (JOSA A 14, 2758). Heights are cut into slices.
"""

from __future__ import annotations

import functools
import importlib.metadata
import time
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError, warn
from ...extras import optional
from ...heights.field import HeightField
from ...optics.orders import crossed_square
from ...progress import Progress, silent
from ..listed import Lights, listed_table
from ..response import orders_between
from ..table import PERIODS, OrderTable, check_wavelengths
from .accuracy import missed_shares
from .grating_index import TabulatedIndex, material_of
from .jobs import Jobs, Solved, digest_of
from .stations import Real

#: Lights at which the table and the solver are checked.
_CHECKED = 24
#: k above which a material absorbs, and the formulations of coupled waves disagree.
_ABSORBING = 1e-3
_LAST_THETA = 85.0


@dataclass(frozen=True)
class UnitCell:
    """A period of heights, its material, and the resolution of the solver.

    Attributes
    ----------
    field : heights of one period in x and y.
    material : below the heights.
    harmonics : largest order of the expansion along x and along y.
    slices : number of layers that the heights are cut into.
    """

    field: HeightField
    material: TabulatedIndex
    harmonics: tuple[int, int]
    slices: int


def solve_crossed(
    field: HeightField,
    material: str | float | complex | TabulatedIndex = 1.5,
    *,
    wavelengths: tuple[float, float] = (380.0, 780.0),
    step: float = 20.0,
    theta_step: float = 10.0,
    phi_step: float = 15.0,
    harmonics: int = 0,
    slices: int = 8,
    executor: Executor | None = None,
    folder: Path | None = None,
    progress: Progress = silent,
) -> OrderTable:
    """Return the table of the orders that a crossed grating reflects, in air.

    The header has the error of the table, `error_mean`, at lights between its own, and the change
    of these lights with one more harmonic and twice the slices, `solver_error`. Mirror planes of
    the heights save half the directions each.

    Raises a DiffractionError if the material is unknown, or the periods are above four times the
    shortest wavelength, or ikarus-rcwa is not installed.

    Parameters
    ----------
    field : heights of one period in x and y.
    material : as of `solve_orders`; a material that absorbs has a warning.
    wavelengths, step : of the table, nm.
    theta_step, phi_step : between directions of the light, degrees.
    harmonics : largest order of the expansion; 0 is one more than the largest order of
        the light, 3 at least.
    slices : number of layers that the heights are cut into.
    executor : processes (`jobs.processes`); None solves here.
    folder : of results, which another run finds again, made when needed; None stores nothing.
    progress : called as progress(done, total, text).
    """
    optional("ikarus")
    periods = field.extent
    last = most_orders(periods, wavelengths)
    medium = material_of(material, wavelengths)
    spread = wavelengths[1] - wavelengths[0]
    lam = np.linspace(*wavelengths, max(round(spread / step), 1) + 1 if spread else 1)
    index = medium.index(lam)
    if index is None:
        raise DiffractionError("crossed gratings of perfect conductors are not solved; give Al")
    if (np.abs(index.imag) > _ABSORBING).any():
        warn(
            f"{medium.name} absorbs: formulations of coupled waves differ by some 4 % of the light "
            "on crossed gratings of metal"
        )
    cell = UnitCell(
        field, medium, (harmonics or max(last[0] + 1, 3), harmonics or max(last[1] + 1, 3)), slices
    )
    theta = np.append(np.arange(0.0, _LAST_THETA, theta_step), _LAST_THETA)
    phi = np.arange(0.0, 360.0 - 1e-9, phi_step)
    lights = {(t, p) for t in theta.tolist() for p in (phi.tolist() if t else [0.0])}
    mirrors = _mirrors(field)
    wanted = {_reduced(light, mirrors)[0] for light in lights}
    outline = (field.extent, cell.harmonics, slices), field.heights, lam, index
    digest = digest_of(*outline)
    solved = Jobs(folder, executor, progress).results(
        functools.partial(_solved, cell, lam, last), sorted(wanted),
        lambda light: (digest, light), "solving directions",
    )  # fmt: skip
    values = np.empty((len(lam), len(theta), len(phi), (2 * last[0] + 1) * (2 * last[1] + 1)))
    for a, t in enumerate(theta.tolist()):
        for b, p in enumerate(phi.tolist()):
            light, flipped = _reduced((t, p if t else 0.0), mirrors)
            powers = solved[light].values[:, :: flipped[1], :: flipped[0]]
            values[:, a, b] = powers.reshape(len(lam), -1)
    orders = orders_between((-last[0], -last[1]), last)
    values[~_propagates(lam, theta, phi, orders, periods)] = np.nan
    header: dict[str, Any] = {
        "solver": f"ikarus-rcwa, {2 * cell.harmonics[0] + 1} x {2 * cell.harmonics[1] + 1} "
        f"harmonics, {slices} slices",
        "solver_version": importlib.metadata.version("ikarus-rcwa"),
        "material": medium.name,
        "profile": f"crossed, {np.ptp(field.heights):.3g} µm deep",
        "depth": float(np.ptp(field.heights)),
    }
    every = Lights(lam, theta, phi, orders, values[:, :, :, None, None, :, None])
    table = listed_table(every, (periods[0], periods[1]), header)
    return replace(table, header=header | _checked(table, cell, last, executor))


def most_orders(periods: tuple[float, float], wavelengths: tuple[float, float]) -> tuple[int, int]:
    """Return the largest order along x and along y that propagates from any direction.

    Raises a DiffractionError for periods or wavelengths out of range.
    """
    low, _ = check_wavelengths(wavelengths)
    # more orders take hours
    longest = min(PERIODS[1], 4e-3 * low)
    if not all(PERIODS[0] <= period <= longest for period in periods):  # also refuses NaN
        raise DiffractionError(
            f"periods={periods[0]:g}, {periods[1]:g} µm must be {PERIODS[0]:g} to {longest:.3g} "
            f"µm, four times the shortest wavelength, {low:g} nm"
        )
    return int(2e3 * periods[0] / low), int(2e3 * periods[1] / low)


def _propagates(
    lam: Real, theta: Real, phi: Real, orders: NDArray[np.int64], periods: tuple[float, float]
) -> NDArray[np.bool_]:
    """Whether orders propagate, (λ, θ, φ, m)."""
    waves, polar, azimuth = (
        part[..., None] for part in np.meshgrid(lam, *map(np.radians, (theta, phi)), indexing="ij")
    )
    x, y = (-np.sin(polar) * part for part in (np.cos(azimuth), np.sin(azimuth)))
    shifts = (1e-3 * m * waves / period for m, period in zip(orders.T, periods, strict=True))
    return np.asarray(crossed_square(x, y, *shifts) > 0.0)


def _solved(cell: UnitCell, lam: Real, last: tuple[int, int], light: tuple[float, float]) -> Solved:
    """Return the efficiencies of `reflected`, with their time."""
    start = time.thread_time()
    return Solved(reflected(cell, light, lam, last), time.thread_time() - start)


def reflected(cell: UnitCell, light: tuple[float, float], lam: Real, last: tuple[int, int]) -> Real:
    """Return the efficiencies (λ, m_y, m_x) of unpolarised light from (θ, φ), degrees."""
    ikarus = optional("ikarus")

    heights = cell.field.heights - cell.field.heights.min()
    depth = float(heights.max())
    # rounded, so that mirror images have the same slices
    shares = np.round(heights / max(depth, 1e-12), 9)
    levels = np.round(1.0 - (np.arange(cell.slices) + 0.5) / cell.slices, 9)
    indices = cell.material.index(lam)
    assert indices is not None
    powers = np.empty((len(lam), 2 * last[1] + 1, 2 * last[0] + 1))
    for n, (wavelength, index) in enumerate(zip(lam, indices, strict=True)):
        shape = heights.shape[::-1]
        solver = ikarus.RCWA(*(1e-6 * d for d in cell.field.extent), resolution=shape,
                             n_orders=cell.harmonics)  # fmt: skip
        solver.add_uniform_layer(np.inf, 1.0)
        for level in levels if depth else ():
            ridges = (shares > level).astype(int).T
            solver.add_layer(1e-6 * depth / cell.slices, ridges, [1.0, complex(index)])
        solver.add_uniform_layer(np.inf, complex(index))
        both = []
        for turn in (0.0, 90.0):
            # its azimuth is that in which the light travels, and its orders count the other way
            solver.set_source(wavelength=1e-9 * wavelength, theta=light[0], phi=light[1] + 180.0,
                              polarization="linear", linear_pol_angle=turn)  # fmt: skip
            result = solver.simulate()[2]
            both.append(np.array(result.R_orders, float))
        mean = 0.5 * (both[0] + both[1])
        for a in range(-last[1], last[1] + 1):
            for b in range(-last[0], last[0] + 1):
                powers[n, a + last[1], b + last[0]] = mean[result.order_index(-b, -a)]
    return np.maximum(np.nan_to_num(powers), 0.0)


def _mirrors(field: HeightField) -> tuple[bool, bool]:
    """Whether the periodic heights equal their mirror images along x and along y."""
    found = []
    for axis in (1, 0):
        image = np.flip(field.heights, axis)
        shifts = (np.roll(image, n, axis) for n in range(image.shape[axis]))
        found.append(any(np.allclose(field.heights, shifted, atol=1e-9) for shifted in shifts))
    return found[0], found[1]


def _reduced(
    light: tuple[float, float], mirrors: tuple[bool, bool]
) -> tuple[tuple[float, float], tuple[int, int]]:
    """Return the light that mirror planes make of a light, and the steps along its orders."""
    theta, phi = light[0], light[1] % 360.0
    steps = [1, 1]
    if mirrors[1] and phi > 180.0:
        phi, steps[1] = 360.0 - phi, -1
    if mirrors[0] and 90.0 < phi < 270.0:
        phi, steps[0] = (180.0 - phi) % 360.0, -1
    return (theta, round(phi, 9)), (steps[0], steps[1])


def _checked(
    table: OrderTable, cell: UnitCell, last: tuple[int, int], executor: Executor | None
) -> dict[str, float]:
    """Return the errors of table and solver at random lights, as shares of the orders but 0."""
    rng = np.random.default_rng(0)
    finer = UnitCell(
        cell.field, cell.material, (cell.harmonics[0] + 1, cell.harmonics[1] + 1), 2 * cell.slices
    )
    m_x, m_y = orders_between((-last[0], -last[1]), last).T.reshape(2, 2 * last[1] + 1, -1)
    others = (m_x != 0) | (m_y != 0)
    polar, azimuth = 70.0 * np.sqrt(rng.random(_CHECKED)), 360.0 * rng.random(_CHECKED)
    lam = rng.uniform(*table.wavelengths, _CHECKED)
    every = map if executor is None else executor.map
    lights, waves = list(zip(polar, azimuth, strict=True)), list(lam[:, None])
    truth, other = (
        np.concatenate(list(every(functools.partial(reflected, c, last=last), lights, waves)))
        for c in (cell, finer)
    )
    sine, turn = np.sin(np.radians(polar)), np.radians(azimuth)
    x, y = -sine * np.cos(turn), -sine * np.sin(turn)
    x, y, lam = (part[:, None, None] for part in (x, y, lam))
    found = table.efficiency(x, y, lam, m_x, m_y)
    parts = np.abs(found - truth), np.abs(other - truth), truth
    missed, moved, light = (part[:, others].sum(axis=-1) for part in parts)
    mean, worst = missed_shares(missed, light)
    change, _ = missed_shares(moved, light)
    return {"error_mean": mean, "error_worst": worst, "solver_error": change}
