"""Orders of listed directions of light, as of an echelle in its mount.

A grating with tens of orders has too many directions for a table of all. In an instrument light
comes from one of them: the efficiencies there, wavelength by wavelength, make a table of listed
light as a file's efficiencies do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Real
from ...errors import DiffractionError, warn
from ..listed import Lights, listed_response, mirror_of, warn_of_gaps
from ..lists import check_light
from ..polarised import ODD
from ..response import LINEAR, MUELLER, orders_between
from ..table import OrderTable, check_outline
from .accuracy import limited, measured_error, warn_of_error
from .crossed import folded
from .jobs import Jobs, Problem
from .nodes import AnyPlace, located
from .resolution import STEP, coarsest, resolved
from .settings import (
    Settings,
    announce_stage,
    header_of,
    solved_stage,
)
from .stations import LEAST_COSINE, Grating

#: Lights by which the resolution is chosen at most, and solutions at most.
_COMPARED, _MOST = 5, 100_000


def solve_directions(
    problem: Problem, directions: tuple[ArrayLike, ArrayLike], step: float, how: Settings,
    work: Jobs, facts: Mapping[str, Any], *, is_all: bool = False,
) -> OrderTable:  # fmt: skip
    """Solve the orders of light from some directions, on all sides of the grating.

    Raises a DiffractionError if the directions are out of their range, too many lights are asked
    for, or efficiencies sum to more than a coarse solution may at higher resolutions, too.

    directions : θ and φ to the light, degrees, of which a grid is made.
    step : between wavelengths, nm.
    facts : entries of the header.
    is_all : whether the directions stand for all light, so that the error between them is measured.
    """
    grating, (low, high) = problem.grating, how.wavelengths
    superstrate, thin, block = grating.media
    check_outline(grating.periods, how.wavelengths, *grating.media, listed=True)
    count = max(int(np.ceil((high - low) / step - 1e-9)), 1) + 1 if high > low else 1
    lam = np.linspace(low, high, count)
    _warn_of_fringes(grating, lam)
    polar, azimuth = (np.unique(np.asarray(angle, np.float64)) for angle in directions)
    check_light(lam, polar, azimuth, "solve_orders")
    shape = lam.size, polar.size, azimuth.size
    if np.prod(shape) * grating.sides > _MOST:
        raise DiffractionError(
            f"{lam.size} wavelengths x {polar.size} theta x {azimuth.size} phi are over {_MOST} "
            "solutions; choose fewer directions, or a larger step"
        )
    number = np.tile(np.arange(azimuth.size), lam.size * polar.size)
    waves, theta = (
        np.repeat(part, azimuth.size) for part in np.meshgrid(lam, polar, indexing="ij")
    )
    bearings, steps, turns = folded(grating.cell, azimuth)
    phi = bearings[number]
    factors = [1.0, 1.0 / block] if block else [1.0] * grating.sides  # side 0 of a block is within
    x, y = (np.round(part, 12) + 0.0 for part in mirror_of(theta, phi))
    if grating.cell is None:  # solvers take y ≥ 0, the mirror image
        y = np.abs(y)
    found = [located(grating, factor * x, factor * y, waves) for factor in factors]
    every = [light.place for of_side in found for light in of_side]
    compared = every[:: -(-len(every) // _COMPARED)]
    if grating.cell is None:
        problem = replace(problem, least_cosine=LEAST_COSINE)
        worst = _nearest_grazing(grating, x, y, waves)
        compared += [of_side[worst].place for of_side in found]
        compared = list(dict.fromkeys(compared))
    ports: dict[AnyPlace, list[int]] = {place: [] for place in every}
    for came, of_side in enumerate(found):
        for light in of_side:
            ports[light.place].append(came * len(light.orders) + light.port)
    coarse = replace(problem, resolution=problem.resolution or coarsest(problem))
    # a solution costs as its matrices: the cube of the resolution
    announce_stage("choosing the resolution", coarse, work, compared, cost=1.0 + STEP**3)
    chosen = resolved(problem, work, compared, how.tolerance / 2, ports)
    ends = np.concatenate([light.orders for of_side in found for light in of_side])
    first, last = ends.min(axis=0), ends.max(axis=0)
    if (steps < 0).any():
        first, last = np.minimum(first, -last), np.maximum(last, -first)
    orders = orders_between(first.tolist(), last.tolist())
    elements = MUELLER if how.polarised else LINEAR
    if grating.thin and (np.abs(y) > 1e-9).any():
        elements = 1  # without phases, which tell s from p
    values = np.full((len(waves), grating.sides, grating.sides, len(orders), elements), np.nan)
    jones = np.full((*values.shape[:-1], 4), np.nan, np.complex128) if how.polarised else None
    problem, solved = solved_stage(chosen.problem, work, every, 4.0 * values.size, ports)
    chosen = chosen._replace(problem=problem)
    for came, of_side in enumerate(found):
        for n, light in enumerate(of_side):
            size, sign = len(light.orders), steps[number[n]]
            rows = limited(elements, solved[light.place])[0, came * size + light.port]
            rows *= np.where(ODD.ravel()[:elements], 0 if grating.thin else sign.prod(), 1)
            places = (light.orders * sign - first) @ [1, int(last[0] - first[0]) + 1]
            for left in range(grating.sides):
                values[n, came, left, places] = rows[left * size : (left + 1) * size]
            if jones is not None:  # no sheet or block
                matrices = solved[light.place][0, light.port].transpose(1, 2, 0).reshape(size, 4)
                phase = np.exp(2j * np.pi * (light.orders @ turns[number[n]]))
                odd = np.array([1, sign.prod(), sign.prod(), 1])
                jones[n, 0, 0, places] = matrices * odd * phase[:, None]
    header = header_of(chosen, how) | dict(facts)
    if not is_all:
        header["directions"] = [[float(t), float(p)] for t in polar for p in azimuth]
    matrices = None if jones is None else jones.reshape(*shape, *jones.shape[1:])
    crossed = grating.cell is not None
    numbers = values.reshape(*shape, *values.shape[1:])
    grid = Lights(lam, polar, azimuth, orders, numbers, crossed, matrices)
    response = listed_response(grid, grating.periods, superstrate, block)
    if is_all:
        # index of a clear material in the middle of its wavelengths
        middle = grating.material.index(0.5 * sum(grating.wavelengths))
        assert middle is not None  # `crossed.check_cell`
        clear = None if middle.imag or middle.real <= 1.0 else float(middle.real)
        response = replace(response, index=clear)
    made = OrderTable(grating.periods, how.wavelengths, response, superstrate, header, thin, block)
    if is_all:
        header |= measured_error(made, chosen.problem, work).facts()
        warn_of_error(header)
    warn_of_gaps(made, f"the table of {grating.profile.name}")
    return replace(made, header=header | {"processor_seconds": round(work.processor_seconds, 1)})


def _warn_of_fringes(grating: Grating, lam: Real) -> None:
    """Warn of layers whose fringes at the shortest wavelength have fewer than two of lam (n,)."""
    (apart, line), step = grating.structure.fringes(lam[0]), float(np.diff(lam[:2]).sum())
    if 2.0 * step > apart:
        most = 0.5e-3 * lam[0] ** 2 / step
        warn(
            f"{line}, and wavelengths are {step:g} nm apart, between which efficiencies are "
            f"interpolated; give step={0.5 * apart:.2g} or less, or layers of 2 Σ n d up to "
            f"{most:.2g} µm"
        )


def _nearest_grazing(grating: Grating, x: Real, y: Real, waves: Real) -> int:
    """Return the light (n,) with the order nearest to grazing, where solvers converge last."""
    steps = waves / (1e3 * grating.optical_period)
    most = int(2.0 / steps.min()) + 1
    leaves = x + np.arange(-most, most + 1)[:, None] * steps
    return int(np.abs(1.0 - leaves**2 - y**2).min(axis=0).argmin())
