"""Error of a table of orders, measured where nothing was solved for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..polarised import mueller_of
from ..response import UNPOLARISED
from ..table import OrderTable
from .jobs import Jobs, Problem
from .nodes import places_at
from .stations import Complex, Real

#: The error that 95 % of directions and wavelengths keep, in tolerances.
WORST = 4.0
#: Random directions and wavelengths at which the error is measured.
SAMPLES = 128
#: Efficiency of an order from which on its relative error is measured.
_COUNTED = 1e-4


class InterpolationError(NamedTuple):
    """Error of interpolation, over random directions and wavelengths.

    mean : of the light in all orders but 0, which the table has too much or too little in an order.
    most : the same of a direction, which 95 % of them keep.
    bands : of each band, from k = 0, as a share of all light.
    polarised : mean of ½‖ΔM‖ of the Mueller matrices, as a share of the same light (½‖M‖ is the
        efficiency); None without them.
    relative : of an order above 1e-4 of the light, and of a polarisation where the table has them,
        relative to its efficiency, which 95 % of them keep.
    largest, place : largest of these, and its light.
    """

    mean: float
    most: float
    bands: Real
    polarised: float | None
    relative: float
    largest: float
    place: str

    def facts(self) -> dict[str, Any]:
        """Return the entries of a header."""
        polarised = {} if self.polarised is None else {"error_polarised": self.polarised}
        return {
            "error_mean": self.mean,
            "error_worst": self.most,
            "error_relative": self.relative,
            "error_largest": self.largest,
            "error_place": self.place,
            **polarised,
        }


def missed_tolerance(header: Mapping[str, Any]) -> bool:
    """Whether a table misses its tolerance, by the measured errors in its header."""
    if "tolerance" not in header or "error_mean" not in header:
        return False
    mean = max(header["error_mean"], header.get("error_polarised", 0.0))
    tolerance = header["tolerance"]
    return bool(mean > tolerance or header["error_worst"] > WORST * tolerance)


def measured_error(table: OrderTable, problem: Problem, jobs: Jobs) -> InterpolationError:
    """Compare a table, as the renderer reads it, with solutions at random lights.

    Directions are sampled as in diffuse light within the superstrate, or a block, wavelengths
    evenly; of two sides, light of each by turns. Where order 0 is alone, it is the colour; of a
    block, the light that goes through.
    """
    x, y, lam = diffuse_light(SAMPLES, table.wavelengths)
    cell, places = places_at(x, y, lam, table.wavelengths, table.optical_period)
    solved = jobs.amplitudes(problem, places, "measuring the error")
    missed, light, turned = np.zeros(SAMPLES), np.zeros(SAMPLES), 0.0
    relative, where = [np.zeros(0)], [""]
    index = table.block or 1.0  # light of a table has its direction above the surface
    guided = index * np.hypot(x, y) >= 1.0
    for n, place in enumerate(places):
        j, count = int(cell.channel[n]), int(cell.channels[n])
        side = n % table.sides * int(not (table.block and guided[n]))
        truth = powers(solved[place])[0, side * count + j]  # (ports, 2)
        orders = j - np.arange(count)
        at, below = (index * x[n], index * y[n], lam[n], orders), (side == 1) != bool(table.block)

        def of_sides(lookup: Any, at: Any = at, below: bool = below, side: int = side) -> Real:
            return np.concatenate([
                lookup(*at, from_below=below, transmitted=other != side)
                for other in range(table.sides)
            ])  # fmt: skip

        if table.response.elements == UNPOLARISED:
            truth = truth.mean(axis=-1, keepdims=True)
            got = of_sides(table.efficiency)[:, None]
        else:
            got = of_sides(table.groove_efficiency)
        alone = np.arange(table.sides) != (side if table.block else -1)
        coloured = np.tile(orders != 0, table.sides) if count > 1 else alone
        difference = np.abs(got.mean(axis=-1) - truth.mean(axis=-1))
        missed[n], light[n] = difference[coloured].sum(), truth.mean(axis=-1)[coloured].sum()
        bright = truth > _COUNTED
        relative.append((np.abs(got - truth) / np.maximum(truth, _COUNTED))[bright])
        where += [
            f"{lam[n]:.1f} nm, x {x[n]:.3f}, y {y[n]:.3f}, order {np.tile(orders, table.sides)[q]}"
            for q, _ in np.argwhere(bright)
        ]
        if table.polarised:
            matrices = table.mueller(x[n], abs(y[n]), lam[n], orders)
            error = matrices - mueller_of(solved[place])[0, j]
            turned += 0.5 * np.linalg.norm(error[coloured], axis=(1, 2)).sum()
    each = np.concatenate(relative)
    largest = int(each.argmax()) if len(each) else -1
    return InterpolationError(
        *missed_shares(missed, light),
        np.bincount(cell.band, missed, len(table.bands)) / light.sum(),
        float(turned / light.sum()) if table.polarised else None,
        float(np.quantile(each, 0.95)) if len(each) else 0.0,
        float(each[largest]) if len(each) else 0.0,
        where[largest + 1] if len(each) else "",
    )


def missed_shares(missed: Real, light: Real) -> tuple[float, float]:
    """Return the missed part of all light, and the part that 95 % of the lights (n,) keep.

    Directions with hardly any light are judged by a twentieth of the mean.
    """
    floor = max(0.05 * float(light.mean()), 1e-12)
    worst = np.quantile(missed / np.maximum(light, floor), 0.95)
    return float(missed.sum()) / max(float(light.sum()), 1e-12), float(worst)


def diffuse_light(count: int, wavelengths: tuple[float, float]) -> tuple[Real, Real, Real]:
    """Return x, y of random directions of diffuse light, and even random wavelengths, nm."""
    rng = np.random.default_rng(0)
    radius, azimuth = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    lam = rng.uniform(*wavelengths, count)
    return radius * np.cos(azimuth), radius * np.sin(azimuth), lam


def powers(amplitudes: Complex) -> Real:
    """Return (w, j, q, 2) of (w, j, 2, q, 2): sums over the leaving light's polarisations."""
    return np.asarray((np.abs(amplitudes) ** 2).sum(axis=-1).swapaxes(2, 3))
