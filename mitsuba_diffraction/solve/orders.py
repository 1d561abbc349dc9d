"""`solve_orders`: from a profile and a material to a table of orders."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import DiffractionError
from ..heights.lengths import number_between
from ..tables.orders import Band, OrderTable, cells
from ..tables.orders.table import Counts, check_outline
from .jobs import Jobs, Problem, problem_of, solver_of
from .materials import Material, material_of
from .nodes import FEWEST, MOST, Line, Place, count_for, lines
from .profiles import Profile
from .resolution import (
    chosen_resolution,
    coarsest,
    energy_error,
    reciprocity_error,
    resolution_error,
)
from .stations import Grating, Real, reversed_light

#: Wavelengths of a table, nm: the visible.
WAVELENGTHS = (380.0, 780.0)
#: Mean error of interpolation between nodes, of the light in all orders but 0.
TOLERANCE = 0.01
#: The error that 95 % of directions and wavelengths keep, in tolerances.
WORST = 4.0
#: Sum over the orders of a solution from which on it is refused; smaller sums above 1, which come
#: of coarse solutions near grazing, are scaled to 1.
MOST_EXCESS = 1.1
#: Least index of a thin sheet: orders of light that goes through depend on n − 1.
LEAST_INDEX = 1.01
#: Random directions and wavelengths at which the error is measured.
SAMPLES = 128


class Estimate(NamedTuple):
    """Work of the next stage: number of stations and solutions (station, wavelength); seconds."""

    stage: str
    stations: int
    solutions: int
    seconds: float


class Measured(NamedTuple):
    """Error of interpolation, over random directions and wavelengths.

    mean : of the light in all orders but 0, which the table has too much or too little in an order.
    most : the same of a direction, which 95 % of them keep.
    """

    mean: float
    most: float


@dataclass(frozen=True)
class Settings:
    """Settings of a table of orders.

    Attributes
    ----------
    wavelengths : shortest and longest, in vacuum, nm.
    tolerance : mean error of interpolation, of the light in all orders but 0.
    method : one of `jobs.METHODS`.
    resolution : points on the boundary, or harmonics; None chooses by convergence.
    """

    wavelengths: tuple[float, float] = WAVELENGTHS
    tolerance: float = TOLERANCE
    method: str = "integral"
    resolution: int | None = None

    def __post_init__(self) -> None:
        number_between(self.tolerance, "tolerance", 1e-4, 0.2)
        if self.resolution is not None and not 4 <= self.resolution <= 4000:
            raise DiffractionError(
                f"resolution={self.resolution} must be 4 to 4000 points (or harmonics)"
            )


def solve_orders(
    profile: Profile,
    material: str | float | complex | Material = "Al",
    *,
    superstrate: float = 1.0,
    thin: bool = False,
    settings: Settings | None = None,
    jobs: Jobs | None = None,
    announce: Callable[[Estimate], None] | None = None,
) -> OrderTable:
    """Solve the orders of a grating for all directions and wavelengths.

    Parameters
    ----------
    profile : one period of the grooves, from `solve.profiles`.
    material : a name that Mitsuba knows, an index n + ik, or "none" for a perfect conductor.
    superstrate : index of the clear medium above.
    thin : whether the material is a thin sheet, whose lower side is flat: the table then has the
        light on both sides (`sheet`). Otherwise it has the reflected orders.
    settings : wavelengths, tolerance, method.
    jobs : where stations are solved and stored; by default here, and stored nowhere.
    announce : called with the estimate of each stage before it starts.

    Raises
    ------
    DiffractionError
        If an argument is out of its range, the solver is not installed or does not converge, or the
        measured error of the table is above the tolerance.
    """
    how, work = settings or Settings(), jobs or Jobs()
    tell = announce or _silent
    check_outline(profile.period, how.wavelengths, superstrate, thin)
    substance = material_of(material, how.wavelengths)
    index = substance.index(how.wavelengths)
    if thin and (index is None or index.imag.any() or index.real.min() < LEAST_INDEX):
        raise DiffractionError(
            f"material {substance.name}: light goes through a thin sheet of a clear material only; "
            f"give its index, a real number of {LEAST_INDEX:g} to 5, such as 1.58"
        )
    grating = Grating(profile, substance, superstrate, how.wavelengths, thin)
    bands = range(cells.largest_band(how.wavelengths, grating.optical_period) + 1)
    problem = problem_of(grating, how.method, how.resolution or 0)
    coarse = replace(problem, resolution=how.resolution or coarsest(problem))
    counts = _counts(coarse, work, bands, how.tolerance, tell)
    if how.resolution is None:
        problem, solver_error = chosen_resolution(problem, work, bands, how.tolerance / 2)
    else:
        solver_error = resolution_error(problem, work, bands)
    places = [p for band in bands for p in _places(band, counts[band])]
    _announce(tell, "solving", problem, work, places)
    solved = work.solve(problem, places, "solving orders")
    header: dict[str, Any] = {
        "solver": solver_of(problem).name,
        "material": grating.material.name,
        "profile": profile.name,
        **_checks(problem, work, bands, solved),
        "solver_error": solver_error,
        "tolerance": how.tolerance,
    }
    made = tuple(_band(band, counts[band], solved, grating.sides) for band in bands)
    table = OrderTable(profile.period, how.wavelengths, made, superstrate, header, thin)
    error = measured_error(table, problem, work)
    if error.mean > how.tolerance or error.most > WORST * how.tolerance:
        raise DiffractionError(
            f"the table misses {error.mean:.2%} of the light in its orders on average and "
            f"{error.most:.2%} in 5 % of directions, at tolerance {how.tolerance:g}; use a larger "
            "tolerance, or fewer wavelengths"
        )
    header |= {
        "error_mean": error.mean,
        "error_worst": error.most,
        "processor_seconds": round(work.processor_seconds, 1),
    }
    return OrderTable(profile.period, how.wavelengths, made, superstrate, header, thin)


def measured_error(table: OrderTable, problem: Problem, jobs: Jobs) -> Measured:
    """Compare a table with solutions at random directions and wavelengths.

    Directions are those of diffuse light within the superstrate, wavelengths even over the table's.
    """
    x, y, lam = _diffuse(SAMPLES, table.wavelengths)
    cell = cells.to_cell(x, y, lam, table.optical_period)
    w = cells.w_of(cell.k_continuous, lam, table.wavelengths, table.optical_period)
    places = [
        Place(int(band), int(kind), float(tau), float(rho), (float(at),))
        for band, kind, tau, rho, at in zip(
            cell.band, cell.kind, cell.tau, cell.rho, w, strict=True
        )
    ]
    solved = jobs.solve(problem, places, "measuring the error")
    missed, light = np.zeros(SAMPLES), np.zeros(SAMPLES)
    for n, place in enumerate(places):
        j = int(cell.channel[n])
        side, count = n % table.sides, int(cell.channels[n])  # from above and below by turns
        truth = solved[place][0, side * count + j].mean(axis=0).sum(axis=-1)  # (ports,)
        orders = j - np.arange(count)
        light_of = partial(table.efficiency, x[n], y[n], lam[n], orders, from_below=side == 1)
        got = np.concatenate([light_of(transmitted=other != side) for other in range(table.sides)])
        orders = np.tile(orders, table.sides)
        # where order 0 is alone, it is the colour
        coloured = orders != 0 if count > 1 else np.ones(len(orders), bool)
        missed[n], light[n] = np.abs(got - truth)[coloured].sum(), truth[coloured].sum()
    floor = 0.05 * light.mean()  # directions with hardly any light in orders
    return Measured(
        float(missed.sum() / light.sum()),
        float(np.quantile(missed / np.maximum(light, floor), 0.95)),
    )


def _counts(
    problem: Problem,
    jobs: Jobs,
    bands: Iterable[int],
    tolerance: float,
    announce: Callable[[Estimate], None],
) -> dict[int, Counts]:
    """Choose the numbers of nodes of each band by series along lines across it."""
    most = Counts(*MOST[:2], 1 if problem.grating.is_perfect else MOST[2])
    drawn = {band: list(lines(band, most)) for band in bands}
    places = [place for of_band in drawn.values() for line in of_band for place in line.places]
    _announce(announce, "choosing nodes", problem, jobs, places)
    solved = jobs.solve(problem, places, "choosing nodes")
    # three variables share the tolerance; rarely seen bands may miss more
    shares = _band_shares(problem.grating, len(drawn))
    return {
        band: _count(
            of_band,
            most,
            solved,
            tolerance / np.sqrt(3 * len(drawn) * share),
            problem.grating.sides,
        )
        for (band, of_band), share in zip(drawn.items(), shares, strict=True)
    }


def _band_shares(grating: Grating, bands: int) -> Real:
    """Return the share of diffuse white light in each band, at least 1/(16 bands).

    If a band of share p misses 1/√(n p) of a tolerance, all n bands together miss the tolerance at
    most (Cauchy and Schwarz).
    """
    x, y, lam = _diffuse(4096, grating.wavelengths)
    band = cells.to_cell(x, y, lam, grating.optical_period).band
    counted = np.bincount(np.minimum(band, bands - 1), minlength=bands) / len(band)
    return np.maximum(counted, 1.0 / (16 * bands))


def _diffuse(count: int, wavelengths: tuple[float, float]) -> tuple[Real, Real, Real]:
    """Return x, y of random directions of diffuse light, and even random wavelengths, nm."""
    rng = np.random.default_rng(0)
    radius, azimuth = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    lam = rng.uniform(*wavelengths, count)
    return radius * np.cos(azimuth), radius * np.sin(azimuth), lam


def _count(
    drawn: Sequence[Line], most: Counts, solved: Mapping[Place, Real], error: float, sides: int
) -> Counts:
    """Return the numbers of nodes that all lines of a band need."""
    needed = [1 if size == 1 else least for size, least in zip(most, FEWEST, strict=True)]
    for line in drawn:
        if most[line.axis] == 1:
            continue
        values = [solved[place] for place in line.places]
        if line.axis == 0:
            values += [reversed_light(value, sides) for value in reversed(values)]
        # (nodes, j, q), unpolarised; order 0 is no colour, and is left out
        along = np.concatenate(values).sum(axis=-1).mean(axis=2)
        if (channels := along.shape[1] // sides) > 1:
            along *= 1.0 - np.tile(np.eye(channels), (sides, sides))
        needed[line.axis] = max(needed[line.axis], count_for(along, FEWEST[line.axis], error))
    return Counts(*needed)


def _places(band: int, counts: Counts) -> list[Place]:
    """Return the stations of a band: the first half of τ, of which reciprocity makes the other."""
    w = tuple(float(value) for value in cells.nodes(counts.w))
    half = cells.nodes(counts.tau)[: (counts.tau + 1) // 2]
    return [
        Place(band, kind, float(tau), float(rho), w)
        for kind in ((cells.A, cells.B) if band else (cells.A,))
        for tau in half
        for rho in cells.nodes(counts.rho)
    ]


def _band(band: int, counts: Counts, solved: Mapping[Place, Real], sides: int) -> Band:
    """Return the efficiencies of a band from those of its stations."""
    kinds = []
    for kind in (cells.A, cells.B) if band else (cells.A,):
        size = sides * (band + 1 - kind)
        values = np.empty((*counts, size, size, 2), np.float32)
        places = iter(place for place in _places(band, counts) if place.kind == kind)
        for n in range((counts.tau + 1) // 2):
            for m in range(counts.rho):
                of_place = solved[next(places)]
                # (w, j, 2, q, 2) to (w, j, q, 2): the sum over the leaving light's polarisations
                values[n, m] = of_place.sum(axis=-1).swapaxes(2, 3)
                back = reversed_light(of_place, sides).sum(axis=-1).swapaxes(2, 3)
                opposite = counts.tau - 1 - n
                values[opposite, m] = back if opposite > n else 0.5 * (values[n, m] + back)
        total = values.sum(axis=-2, keepdims=True)
        if total.max() > MOST_EXCESS:
            raise DiffractionError(
                f"efficiencies of a solution sum to {total.max():.4g}; use a higher "
                "resolution, or a smaller tolerance"
            )
        kinds.append(values / np.maximum(total, 1.0))
    return Band(band, *kinds)


def _checks(
    problem: Problem, jobs: Jobs, bands: Iterable[int], solved: Mapping[Place, Real]
) -> dict[str, float]:
    """Return the largest violation of reciprocity, in any band, and a sheet's of energy."""
    places = [
        Place(band, kind, 0.5, 0.41, (0.5,))
        for band in bands
        for kind in ((cells.A, cells.B) if band else (cells.A,))
    ]
    thin = problem.grating.thin
    one_way = reciprocity_error(jobs.solve(problem, places, "checking reciprocity"), thin)
    energy = {"energy_error": energy_error(solved.values())} if thin else {}
    return {"reciprocity_error": one_way, **energy}


def _announce(
    announce: Callable[[Estimate], None],
    stage: str,
    problem: Problem,
    jobs: Jobs,
    places: Sequence[Place],
) -> None:
    """Time the stage's middle station and announce the stage."""
    if announce is _silent:
        return
    middle = places[len(places) // 2]
    seconds = jobs.seconds(problem, middle) / len(middle.w)
    solutions = sum(len(place.w) for place in places)
    announce(Estimate(stage, len(places), solutions, seconds * solutions))


def _silent(estimate: Estimate) -> None:
    """Announce nothing."""
