"""Error of a table of orders, measured where nothing was solved for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Complex, Real
from ...errors import warn
from ..polarised import mueller_of, turned_axes
from ..response import UNPOLARISED, CellResponse
from ..table import OrderTable
from ..table_error import TableError, table_error, unpolarised
from .jobs import Jobs, Problem
from .nodes import Place, located

#: The error that 95 % of directions and wavelengths keep, in tolerances.
WORST = 4.0
#: Random directions and wavelengths at which the error is measured.
SAMPLES = 128
#: Efficiency of an order from which on its relative error is measured.
_COUNTED = 1e-4


class InterpolationError(NamedTuple):
    """Error of interpolation, over random directions and wavelengths.

    table : of all orders but 0; relative errors are of orders above 1e-4 of the light.
    bands : of each band, from k = 0, as a share of all light.
    polarised : mean of ½‖ΔM‖ of the Mueller matrices, as a share of the same light (½‖M‖ is the
        efficiency); None without them.
    """

    table: TableError
    bands: Real
    polarised: float | None

    @property
    def mean(self) -> float:
        """Larger one of the mean errors, of efficiencies and of matrices."""
        return max(self.table.mean, self.polarised or 0.0)

    def facts(self) -> dict[str, Any]:
        """Return the entries of a header."""
        polarised = {} if self.polarised is None else {"error_polarised": self.polarised}
        return self.table.facts() | polarised


def missed_tolerance(header: Mapping[str, Any]) -> bool:
    """Whether a table misses its tolerance, by the measured errors in its header."""
    if "tolerance" not in header or "error_mean" not in header:
        return False
    mean = max(header["error_mean"], header.get("error_polarised", 0.0))
    tolerance = header["tolerance"]
    return bool(mean > tolerance or header["error_worst"] > WORST * tolerance)


def warn_of_error(header: Mapping[str, Any]) -> None:
    """Warn of a table that misses its tolerance."""
    if missed_tolerance(header):
        tolerance = header["tolerance"]
        warn(
            f"the table misses {header['error_mean']:.2%} of the light in its orders on average "
            f"(tolerance {tolerance:.2%}) and {header['error_worst']:.2%} in 5 % of directions "
            f"(tolerance {WORST * tolerance:.2%}); use a larger tolerance, or fewer wavelengths"
        )


def measured_error(table: OrderTable, problem: Problem, jobs: Jobs) -> InterpolationError:
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
        below, ports = (side == 1) != bool(table.block), slice(count * table.sides)
        truth[n, ports], found[n, ports] = by_polarisation(
            table, solved[place], at, side * count + port, below
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

    missed, light = unpolarised(found, truth, coloured)
    bands = [light.place.band if isinstance(light.place, Place) else 0 for light in lights]
    return InterpolationError(
        table_error(found, truth, coloured, _COUNTED, name),
        np.bincount(bands, missed, table.last_band + 1) / light.sum(),
        float(turned / light.sum()) if table.polarised else None,
    )


def by_polarisation(
    table: OrderTable, amplitudes: Complex, at: tuple[Any, ...], port: int, below: bool
) -> tuple[Real, Real]:
    """Return solved and tabulated efficiencies of all ports, (ports, 1 or 2).

    Of light of each polarisation along the grooves; of s and of p in tables of a list.
    """

    def of_sides(lookup: Any) -> Real:
        return np.concatenate([
            lookup(*at, from_below=below, transmitted=bool(other) != (below != bool(table.block)))
            for other in range(table.sides)
        ])  # fmt: skip

    truth = powers(amplitudes)[0, port]
    if table.response.elements == UNPOLARISED:
        return truth.mean(axis=-1, keepdims=True), of_sides(table.efficiency)[:, None]
    if isinstance(table.response, CellResponse):
        return truth, of_sides(table.groove_efficiency)
    turned = turned_axes(at[0], at[1])
    mean, cosine, sine = mueller_of(amplitudes)[0, port].reshape(-1, 16)[:, :3].T
    half = cosine * turned.cosine + sine * turned.sine
    return np.stack([mean + half, mean - half], axis=-1), of_sides(table.polarised_efficiency)


def diffuse_light(count: int, wavelengths: tuple[float, float]) -> tuple[Real, Real, Real]:
    """Return x, y of random directions of diffuse light, and even random wavelengths, nm."""
    rng = np.random.default_rng(0)
    radius, azimuth = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    lam = rng.uniform(*wavelengths, count)
    return radius * np.cos(azimuth), radius * np.sin(azimuth), lam


def powers(amplitudes: Complex) -> Real:
    """Return (w, j, q, 2) of (w, j, 2, q, 2): sums over the leaving light's polarisations."""
    return np.asarray((np.abs(amplitudes) ** 2).sum(axis=-1).swapaxes(2, 3))
