"""Error of a table of orders, measured where nothing was solved for it."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from ..tables.orders import OrderTable, cells
from ..tables.orders.polarised import mueller_of
from .jobs import Jobs, Problem
from .nodes import Place
from .stations import Complex, Real

#: The error that 95 % of directions and wavelengths keep, in tolerances.
WORST = 4.0
#: Random directions and wavelengths at which the error is measured.
SAMPLES = 128


class Measured(NamedTuple):
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


def measured_error(table: OrderTable, problem: Problem, jobs: Jobs) -> Measured:
    """Compare a table with solutions at random directions and wavelengths.

    Directions are sampled as in diffuse light within the superstrate, wavelengths evenly.
    """
    x, y, lam = diffuse_light(SAMPLES, table.wavelengths)
    cell = cells.to_cell(x, y, lam, table.optical_period)
    w = cells.w_of(cell.k_continuous, lam, table.wavelengths, table.optical_period)
    places = [
        Place(int(band), int(kind), float(tau), float(rho), (float(at),))
        for band, kind, tau, rho, at in zip(
            cell.band, cell.kind, cell.tau, cell.rho, w, strict=True
        )
    ]
    solved = jobs.amplitudes(problem, places, "measuring the error")
    missed, light, turned = np.zeros(SAMPLES), np.zeros(SAMPLES), 0.0
    for n, place in enumerate(places):
        j = int(cell.channel[n])
        side, count = n % table.sides, int(cell.channels[n])  # from above and below by turns
        truth = powers(solved[place])[0, side * count + j].mean(axis=-1)  # (ports,)
        orders = j - np.arange(count)
        of = functools.partial(table.efficiency, x[n], y[n], lam[n], orders, from_below=side == 1)
        got = np.concatenate([of(transmitted=other != side) for other in range(table.sides)])
        # where order 0 is alone, it is the colour
        coloured = np.tile(orders != 0 if count > 1 else True, table.sides)
        missed[n], light[n] = np.abs(got - truth)[coloured].sum(), truth[coloured].sum()
        if table.polarised:
            matrices = table.mueller(x[n], abs(y[n]), lam[n], orders)
            error = matrices - mueller_of(solved[place])[0, j]
            turned += 0.5 * np.linalg.norm(error[coloured], axis=(1, 2)).sum()
    floor = 0.05 * light.mean()  # directions with hardly any light in orders
    return Measured(
        float(missed.sum() / light.sum()),
        float(np.quantile(missed / np.maximum(light, floor), 0.95)),
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
