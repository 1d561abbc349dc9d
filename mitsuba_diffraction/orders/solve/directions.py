"""Orders of listed directions of light, as of an echelle in its mount.

A grating with tens of orders has too many directions for a table of all. In an instrument light
comes from one of them: the efficiencies there, wavelength by wavelength, make a table of listed
light as a file's efficiencies do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...errors import DiffractionError
from ..listed import Lights, listed_table, warn_of_gaps
from ..lists import check_light
from ..polarised import mueller_of
from ..response import LINEAR, MUELLER, orders_between
from ..table import OrderTable, check_outline
from .accuracy import powers
from .jobs import LEAST_COSINES, Jobs, Problem
from .nodes import places_at
from .resolution import resolved
from .settings import (
    MOST_EXCESS,
    Estimate,
    Settings,
    announce_comparison,
    announce_stage,
    header_of,
)
from .stations import Complex, Real

#: Lights of which the resolution is chosen, and solutions at most.
_COMPARED, _MOST = 5, 100_000


class Directions(NamedTuple):
    """Directions to the light, degrees, a grid of θ and φ; step between wavelengths, nm."""

    theta: ArrayLike
    phi: ArrayLike = 0.0
    step: float = 5.0


def solve_directions(
    problem: Problem, lights: Directions, how: Settings, work: Jobs,
    announce: Callable[[Estimate], None], facts: Mapping[str, Any],
) -> OrderTable:  # fmt: skip
    """Solve the orders of light from some directions, on all sides of the grating.

    Raises a DiffractionError if the directions are out of their range, too many lights are asked
    for, or efficiencies sum to more than a coarse solution may.

    facts : entries of the header.
    """
    grating, (low, high) = problem.grating, how.wavelengths
    block = grating.superstrate if grating.block else None
    superstrate = 1.0 if block else grating.superstrate
    periods = grating.profile.period, math.inf
    check_outline(periods, how.wavelengths, superstrate, grating.thin, block, listed=True)
    count = max(int(np.ceil((high - low) / lights.step - 1e-9)), 1) + 1 if high > low else 1
    lam = np.linspace(low, high, count)
    polar, azimuth = (np.unique(np.asarray(angle, np.float64)) for angle in lights[:2])
    check_light(lam, polar, azimuth, "solve_orders")
    sides, shape = grating.sides, (lam.size, polar.size, azimuth.size)
    if np.prod(shape) * sides > _MOST:
        raise DiffractionError(
            f"{lam.size} wavelengths x {polar.size} theta x {azimuth.size} phi are over {_MOST} "
            "solutions; choose fewer directions, or a larger step"
        )
    waves, theta, phi = (part.ravel() for part in np.meshgrid(lam, polar, azimuth, indexing="ij"))
    sine, turn = np.sin(np.radians(theta)), np.radians(phi)
    least = LEAST_COSINES.get(problem.method, 0.0)
    most = int(2e3 * grating.optical_period / low) + 1
    steps = np.arange(-most, most + 1)[:, None] * waves / (1e3 * grating.optical_period)
    c = np.sqrt(1.0 - np.minimum((sine * np.sin(turn)) ** 2, 1.0))
    square = 1.0 - ((steps - sine * np.cos(turn)) / c) ** 2
    if (near := (square > 0.0) & (square < least**2)).any():
        n = int(np.argwhere(near)[0][1])
        raise DiffractionError(
            f"at {waves[n]:g} nm, theta {theta[n]:g}°, phi {phi[n]:g}° an order leaves within 1.7° "
            f"of grazing, where method {problem.method} loses its digits; use method=coupled or "
            "chandezon, or leave this light out"
        )
    # solvers take y ≥ 0, the mirror image; side 0 of a block lies within
    factors = [1.0, 1.0 / block] if block else [1.0] * sides
    cell_of, places = [], []
    for factor in factors:
        x, y = -factor * sine * np.cos(turn), factor * np.abs(sine * np.sin(turn))
        cell, of_side = places_at(x, y, waves, how.wavelengths, grating.optical_period)
        cell_of.append(cell)
        places.append(of_side)
    every = [place for of_side in places for place in of_side]
    compared = every[:: max(len(every) // _COMPARED, 1)]
    announce_comparison(announce, problem, work, compared)
    chosen = resolved(problem, work, compared, how.tolerance / 2)
    first = int(min((cell.channel - cell.channels + 1).min() for cell in cell_of))
    last = int(max(cell.channel.max() for cell in cell_of))
    orders = orders_between((first, 0), (last, 0))
    elements = MUELLER if how.polarised else LINEAR
    conical = bool((np.abs(np.sin(turn) * sine) > 1e-9).any())
    if grating.thin and conical:  # without phases, which tell s from p
        elements = 1
    values = np.full((len(waves), sides, sides, len(orders), elements), np.nan)
    announce_stage(announce, "solving", chosen.problem, work, every, 4.0 * values.size)
    solved = work.amplitudes(chosen.problem, every, "solving orders")
    for came, (cell, of_side) in enumerate(zip(cell_of, places, strict=True)):
        for n, (place, j) in enumerate(zip(of_side, cell.channel.tolist(), strict=True)):
            size = int(cell.channels[n])
            light = _elements(solved[place], came * size + j, elements, grating.thin)
            for left in range(sides):
                part = light[left * size : (left + 1) * size]
                values[n, came, left, j - np.arange(size) - first] = part
    header = (
        header_of(chosen, how)
        | dict(facts)
        | {
            "directions": [[float(t), float(p)] for t in polar for p in azimuth],
            "processor_seconds": round(work.processor_seconds, 1),
        }
    )
    table = Lights(lam, polar, azimuth, orders, values.reshape(*shape, *values.shape[1:]))
    made = listed_table(
        table, periods, header, superstrate=superstrate, thin=grating.thin, block=block,
    )  # fmt: skip
    warn_of_gaps(made, table, f"the table of {grating.profile.name}")
    return made


def _elements(amplitudes: Complex, port: int, count: int, thin: bool) -> Real:
    """Return the first elements (q, n) of the matrices from a port, scaled to sums of 1 at most.

    thin : whether amplitudes are roots of efficiencies, without phases.

    Raises a DiffractionError if they sum to more than a coarse solution may.
    """
    if thin:
        along = powers(amplitudes)[0, port]
        rows = np.stack([along.mean(axis=-1), 0.5 * (along[:, 0] - along[:, 1]), 0.0 * along[:, 0]],
                        axis=-1)[:, :count]  # fmt: skip
    else:
        rows = mueller_of(amplitudes)[0, port].reshape(-1, MUELLER)[:, :count]
    total = float(rows[:, 0].sum())
    if total > MOST_EXCESS:
        raise DiffractionError(
            f"efficiencies of a solution sum to {total:.4g}; use a higher resolution, or another "
            "method"
        )
    return np.asarray(rows / max(total, 1.0))
