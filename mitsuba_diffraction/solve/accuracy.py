"""Error of a table of orders, measured where nothing was solved for it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..tables.orders import OrderTable
from ..tables.orders.polarised import mueller_of
from .jobs import Jobs, Problem
from .nodes import places_at
from .samples import missed_shares
from .stations import Complex, Real

#: The error that 95 % of directions and wavelengths keep, in tolerances.
WORST = 4.0
#: Random directions and wavelengths at which the error is measured.
SAMPLES = 128


class InterpolationError(NamedTuple):
    """Error of interpolation, over random directions and wavelengths.

    mean : of the light in all orders but 0, which the table has too much or too little in an order.
    most : the same of a direction, which 95 % of them keep.
    bands : of each band, from k = 0, as a share of all light.
    polarised : mean of ½‖ΔM‖ of the Mueller matrices, as a share of the same light (½‖M‖ is the
        efficiency); None without them.
    """

    mean: float
    most: float
    bands: Real
    polarised: float | None

    def within(self, tolerance: float) -> bool:
        """Whether mean error and 95 % quantile are within a tolerance and `WORST` times it."""
        mean = max(self.mean, self.polarised or 0.0)
        return mean <= tolerance and self.most <= WORST * tolerance


def measured_error(table: OrderTable, problem: Problem, jobs: Jobs) -> InterpolationError:
    """Compare a table with solutions at random directions and wavelengths.

    Directions are sampled as in diffuse light within the superstrate, or a block, wavelengths
    evenly; of two sides, light of each by turns. Where order 0 is alone, it is the colour; of a
    block, the light that goes through.
    """
    x, y, lam = diffuse_light(SAMPLES, table.wavelengths)
    cell, places = places_at(x, y, lam, table.wavelengths, table.optical_period)
    solved = jobs.amplitudes(problem, places, "measuring the error")
    missed, light, turned = np.zeros(SAMPLES), np.zeros(SAMPLES), 0.0
    index = table.block or 1.0  # light of a table has its direction above the surface
    guided = index * np.hypot(x, y) >= 1.0
    for n, place in enumerate(places):
        j, count = int(cell.channel[n]), int(cell.channels[n])
        side = n % table.sides * int(not (table.block and guided[n]))
        truth = powers(solved[place])[0, side * count + j].mean(axis=-1)  # (ports,)
        orders = j - np.arange(count)
        at, below = (index * x[n], index * y[n], lam[n], orders), (side == 1) != bool(table.block)
        got = np.concatenate([
            table.efficiency(*at, from_below=below, transmitted=other != side)
            for other in range(table.sides)
        ])  # fmt: skip
        alone = np.arange(table.sides) != (side if table.block else -1)
        coloured = np.tile(orders != 0, table.sides) if count > 1 else alone
        missed[n], light[n] = np.abs(got - truth)[coloured].sum(), truth[coloured].sum()
        if table.polarised:
            matrices = table.mueller(x[n], abs(y[n]), lam[n], orders)
            error = matrices - mueller_of(solved[place])[0, j]
            turned += 0.5 * np.linalg.norm(error[coloured], axis=(1, 2)).sum()
    return InterpolationError(
        *missed_shares(missed, light),
        np.bincount(cell.band, missed, len(table.bands)) / light.sum(),
        float(turned / light.sum()) if table.polarised else None,
    )


def diffuse_light(count: int, wavelengths: tuple[float, float]) -> tuple[Real, Real, Real]:
    """Return x, y of random directions of diffuse light, and even random wavelengths, nm."""
    rng = np.random.default_rng(0)
    radius, azimuth = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    lam = rng.uniform(*wavelengths, count)
    return radius * np.cos(azimuth), radius * np.sin(azimuth), lam


def powers(amplitudes: Complex) -> Real:
    """Return (w, j, q, 2) of (w, j, 2, q, 2): sums over the leaving light's polarisations."""
    return np.asarray((np.abs(amplitudes) ** 2).sum(axis=-1).swapaxes(2, 3))
