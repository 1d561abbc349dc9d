"""Error of a table of orders, measured where nothing was solved for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arrays import Complex, Real
from ...errors import warn
from ..efficiency import shares_along
from ..polarised import mueller_of
from ..response import MUELLER, UNPOLARISED
from ..table import OrderTable
from ..table_error import TableError, table_error
from .jobs import Jobs, Problem
from .nodes import located

#: The error that 95 % of directions and wavelengths keep, in tolerances.
WORST = 4.0
#: Random directions and wavelengths at which the error is measured.
SAMPLES = 128
#: Efficiency of an order from which on its relative error is measured.
_COUNTED = 1e-4


def missed_tolerance(header: Mapping[str, Any], part: float = 1.0) -> bool:
    """Whether a table misses part of its tolerance, by the measured errors in its header."""
    if "tolerance" not in header or "error_mean" not in header:
        return False
    mean = max(header["error_mean"], header.get("error_polarised", 0.0))
    tolerance = part * header["tolerance"]
    return bool(mean > tolerance or header["error_worst"] > WORST * tolerance)


def warn_of_error(header: Mapping[str, Any], hint: str = "") -> None:
    """Warn of a table that misses its tolerance; hint : on its layers."""
    if missed_tolerance(header):
        tolerance = header["tolerance"]
        warn(
            f"the table misses {header['error_mean']:.2%} of the light in its orders on average "
            f"(tolerance {tolerance:.2%}) and {header['error_worst']:.2%} in 5 % of directions "
            f"(tolerance {WORST * tolerance:.2%}); use a larger tolerance, or fewer wavelengths"
            + hint
        )


def measured_error(table: OrderTable, problem: Problem, jobs: Jobs) -> TableError:
    """Compare a table, as the renderer reads it, with solutions at random lights.

    Directions are sampled as in diffuse light within the superstrate, or a block, wavelengths
    evenly; of two sides, light of each by turns. Where order 0 is alone, it is the colour; of a
    block, the light that goes through.
    """
    x, y, lam = diffuse_light(SAMPLES, table.wavelengths)
    lights = located(problem.grating, x, y, lam)
    solved = jobs.amplitudes(problem, [light.place for light in lights], "measuring the error")
    index = table.block or 1.0  # light of a table has its direction above the surface
    guided = index * np.hypot(x, y) >= 1.0
    most = table.sides * max(len(light.orders) for light in lights)
    truth, found = np.zeros((2, SAMPLES, most, 1 if table.response.elements == UNPOLARISED else 2))
    coloured, turned = np.zeros((SAMPLES, most), bool), 0.0
    for n, (place, port, orders) in enumerate(lights):
        count = len(orders)
        side = n % table.sides * int(not (table.block and guided[n]))
        at = index * x[n], index * y[n], lam[n], *orders.T
        ports = slice(count * table.sides)
        truth[n, ports], found[n, ports] = by_polarisation(
            table, solved[place], at, side * count + port, side
        )
        alone = np.arange(table.sides) != (side if table.block else -1)
        lit = np.tile(orders.any(axis=1), table.sides) if count > 1 else alone
        coloured[n, ports] = lit
        if table.polarised:
            matrices = table.mueller(x[n], y[n] if table.crossed else abs(y[n]), *at[2:])
            error = matrices - mueller_of(solved[place])[0, port]
            turned += 0.5 * np.linalg.norm(error[lit], axis=(1, 2)).sum()

    def name(n: int, q: int, _: int) -> str:
        m_x, m_y = lights[n].orders[q % len(lights[n].orders)]
        order = f"({m_x}, {m_y})" if table.crossed else f"{m_x}"
        return f"{lam[n]:.1f} nm, x {x[n]:.3f}, y {y[n]:.3f}, order {order}"

    error = table_error(found, truth, coloured, _COUNTED, name)
    light = (truth.mean(axis=-1) * coloured).sum()
    return error._replace(polarised=float(turned / light)) if table.polarised else error


def by_polarisation(
    table: OrderTable, amplitudes: Complex, at: tuple[Any, ...], port: int, came: int
) -> tuple[Real, Real]:
    """Return solved and tabulated efficiencies of all ports, (ports, 1 or 2).

    Of light of each polarisation along the grooves; came : side that it comes from, 0 or 1.
    """
    shares = [shares_along(table, *at, **table.passage(came, left)) for left in range(table.sides)]
    truth, found = powers(amplitudes)[0, port], np.concatenate(shares)
    return (truth if found.shape[-1] > 1 else truth.mean(axis=-1, keepdims=True)), found


def diffuse_light(count: int, wavelengths: tuple[float, float]) -> tuple[Real, Real, Real]:
    """Return x, y of random directions of diffuse light, and even random wavelengths, nm."""
    rng = np.random.default_rng(0)
    radius, azimuth = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    lam = rng.uniform(*wavelengths, count)
    return radius * np.cos(azimuth), radius * np.sin(azimuth), lam


def powers(amplitudes: Complex) -> Real:
    """Return (w, j, q, 2) of (w, j, 2, q, 2): sums over the leaving light's polarisations."""
    return np.asarray((np.abs(amplitudes) ** 2).sum(axis=-1).swapaxes(2, 3))


def limited(count: int, amplitudes: Complex) -> Real:
    """Return the first elements of the Mueller matrices of amplitudes, (w, j, q, count).

    Amplitudes are scaled where their powers sum to more than 1.
    """
    total = powers(amplitudes).sum(axis=2)
    matrices = mueller_of(amplitudes / np.sqrt(np.maximum(total, 1.0))[..., None, None])
    return matrices.reshape(*matrices.shape[:-2], MUELLER)[..., :count]
