"""`solve_orders`: from a profile and a material to a table of orders."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import DiffractionError, quoted, warn
from ..heights.lengths import count_between, number_between
from ..tables.orders import Band, OrderTable, cells
from ..tables.orders.polarised import ODD, mueller_of
from ..tables.orders.table import MOST_NODES, Counts, check_outline
from .accuracy import WORST, InterpolationError, diffuse_light, measured_error, powers
from .films import Layers, Substance, material_text, structure_of
from .grating_index import TabulatedIndex, material_of
from .jobs import AUTO, MOST_RESOLUTION, Jobs, Problem, problem_of, solver_of
from .nodes import (
    MAX_NODES,
    MIN_NODES,
    Line,
    Place,
    at_nodes,
    count_for,
    kinds_of,
    lines,
    places_of,
)
from .profiles import Profile
from .resolution import (
    Chosen,
    coarsest,
    energy_error,
    finer_problem,
    places_to_test,
    reciprocity_error,
    resolved,
)
from .sheet import check_clear
from .stations import Complex, Grating, Real, reversed_light

#: Wavelengths of a table, nm: the visible.
WAVELENGTHS = (380.0, 780.0)
#: Mean error of interpolation between nodes, of the light in all orders but 0.
TOLERANCE = 0.01
#: Times that a table which misses its tolerance gets more nodes, and their factor.
REFINEMENTS, _FINER = 2, 1.4
#: Times that the resolution is raised, if solutions at nodes have light from nothing.
_RAISED = 3
#: Sum over the orders of a solution from which on it is refused; smaller sums above 1, which come
#: of coarse solutions near grazing, are scaled to 1.
MOST_EXCESS = 1.1


class Estimate(NamedTuple):
    """Work of the next stage: number of stations and solutions (station, wavelength); seconds."""

    stage: str
    stations: int
    solutions: int
    seconds: float


@dataclass(frozen=True)
class Settings:
    """Settings of a table of orders.

    Attributes
    ----------
    wavelengths : shortest and longest, in vacuum, nm.
    tolerance : mean error of interpolation, of the light in all orders but 0; 95 % of directions
        keep `WORST` times as much.
    method : one of `jobs.METHODS`, or "auto": Chandezon's for slopes, else the integral method.
    resolution : points on the boundary, or harmonics; None chooses by convergence.
    polarised : whether the table has Mueller matrices.
    """

    wavelengths: tuple[float, float] = WAVELENGTHS
    tolerance: float = TOLERANCE
    method: str = AUTO
    resolution: int | None = None
    polarised: bool = False

    def __post_init__(self) -> None:
        number_between(self.tolerance, "tolerance", 1e-4, 0.2)
        if self.resolution is not None:
            count_between(self.resolution, "resolution", 4, max(MOST_RESOLUTION.values()))


def solve_orders(
    profile: Profile,
    material: str | float | complex | TabulatedIndex = "Al",
    *,
    superstrate: float = 1.0,
    thin: bool = False,
    layers: Layers = (),
    beneath: Layers = (),
    substrate: Substance | None = None,
    settings: Settings | None = None,
    jobs: Jobs | None = None,
    announce: Callable[[Estimate], None] | None = None,
) -> OrderTable:
    """Solve the orders of a grating for all directions and wavelengths.

    Warns if the measured error of the table is above the tolerance after two refinements.

    Raises a DiffractionError if an argument is out of its range, or the solver is not installed or
    does not converge.

    Parameters
    ----------
    profile : one period of the grooves, from `solve.profiles`.
    material : a name that Mitsuba knows, an index n + ik, or "none" for a perfect conductor.
    superstrate : index of the clear medium above.
    thin : whether the material is a thin sheet, whose lower side is flat: the table then has the
        light on both sides (`sheet`). Otherwise it has the reflected orders.
    layers : films on the profile, from the material upwards, such as [("1.46", 0.1)]: material and
        thickness along z, µm. They interfere; walls have none.
    beneath : layers beneath the profile, from the substrate upwards, and slices (`films.Layers`).
    substrate : below them; by default the material.
    settings : wavelengths, tolerance, method.
    jobs : where stations are solved and stored; by default here, and stored nowhere.
    announce : called with the estimate of each stage before it starts.
    """
    if not isinstance(profile, Profile):
        raise DiffractionError(
            f"solve_orders: expected a profile, as of md.profiles.lamellar, got {quoted(profile)}; "
            "a recipe is solved by the command 'solve'"
        )
    how, work = settings or Settings(), jobs or Jobs()
    tell = announce or silent
    check_outline(profile.period, how.wavelengths, superstrate, thin)
    substance = material_of(material, how.wavelengths)
    if thin:
        check_clear(substance, how.wavelengths)
    if thin and how.polarised:
        raise DiffractionError(
            "polarised: tables of thin sheets have efficiencies alone; leave out polarised, or thin"
        )
    structure = structure_of(
        profile, substance, how.wavelengths,
        layers=layers, beneath=beneath, substrate=substrate, thin=thin,
    )  # fmt: skip
    grating = Grating(profile, substance, superstrate, how.wavelengths, thin, structure)
    bands = range(cells.largest_band(how.wavelengths, grating.optical_period) + 1)
    problem = problem_of(grating, how.method, how.resolution or 0)
    chosen = resolved(problem, work, places_to_test(bands), how.tolerance / 2)
    coarse = problem = chosen.problem
    if how.resolution is None and problem.method == "integral":  # others cost about the same
        coarse = replace(problem, resolution=coarsest(problem))
    counts = _counts(coarse, work, bands, how, tell)
    header = header_of(chosen, how)
    for refinement in range(REFINEMENTS + 1):
        problem, solved = _solved_at_nodes(problem, counts, work, tell)
        header |= {
            "solver": solver_of(problem).name,
            "reciprocity_error": _reciprocity(problem, work, bands),
        }
        if thin:
            header["energy_error"] = energy_error(np.abs(values) ** 2 for values in solved.values())
        made = tuple(_band(k, counts[k], solved, how.polarised, grating.sides) for k in bands)
        table = OrderTable(profile.period, how.wavelengths, made, superstrate, header, thin)
        error = measured_error(table, problem, work)
        if error.within(how.tolerance) or refinement == REFINEMENTS:
            break
        counts = _refined_counts(counts, error.bands)
    conclude(header, error, how, work)
    return table


def header_of(chosen: Chosen, how: Settings) -> dict[str, Any]:
    """Return the entries that the headers of all solved tables have."""
    grating = chosen.problem.grating
    return {
        "solver": solver_of(chosen.problem).name,
        "material": material_text(grating),
        "profile": grating.profile.name,
        "depth": grating.profile.depth,
        "solver_error": chosen.error,
        "tolerance": how.tolerance,
    }


def conclude(header: dict[str, Any], error: InterpolationError, how: Settings, jobs: Jobs) -> None:
    """Add a table's error to its header; warn if it is above the tolerance."""
    header |= {"error_mean": error.mean, "error_worst": error.most}
    header["processor_seconds"] = round(jobs.processor_seconds, 1)
    if error.polarised is not None:
        header["error_polarised"] = error.polarised
    if error.within(how.tolerance):
        return
    mean = max(error.mean, error.polarised or 0.0)
    warn(
        f"the table misses {mean:.2%} of the light in its orders on average (tolerance "
        f"{how.tolerance:.2%}) and {error.most:.2%} in 5 % of directions (tolerance "
        f"{WORST * how.tolerance:.2%}); fewer wavelengths need fewer nodes"
    )


def _solved_at_nodes(
    problem: Problem,
    counts: Mapping[int, Counts],
    jobs: Jobs,
    announce: Callable[[Estimate], None],
) -> tuple[Problem, dict[Place, Complex]]:
    """Solve all nodes, at a higher resolution if solutions have light from nothing."""
    places = [place for band in counts for place in places_of(band, counts[band])]
    for _ in range(_RAISED):
        announce_stage(announce, "solving", problem, jobs, places)
        solved = jobs.amplitudes(problem, places, "solving orders")
        excess = max(float(powers(values).sum(axis=2).max()) for values in solved.values())
        if excess <= MOST_EXCESS:
            return problem, solved
        problem = finer_problem(problem)
    raise DiffractionError(
        f"efficiencies of a solution sum to {excess:.4g}, also at resolution {problem.resolution}; "
        "use another method, a higher resolution, or a smoother profile"
    )


def _refined_counts(counts: Mapping[int, Counts], missed: Real) -> dict[int, Counts]:
    """Return more nodes for the bands that miss most: at least a mean band's share."""
    return {
        k: Counts(*(n if n == 1 else min(int(np.ceil(_FINER * n)), MOST_NODES) for n in of_band))
        if missed[k] >= missed.mean()
        else of_band
        for k, of_band in counts.items()
    }


def _counts(
    problem: Problem,
    jobs: Jobs,
    bands: Iterable[int],
    how: Settings,
    announce: Callable[[Estimate], None],
) -> dict[int, Counts]:
    """Choose the numbers of nodes of each band by series along lines across it."""
    most = Counts(*MAX_NODES[:2], 1 if problem.grating.is_perfect else MAX_NODES[2])
    drawn = {band: list(lines(band, most)) for band in bands}
    places = [place for of_band in drawn.values() for line in of_band for place in line.places]
    announce_stage(announce, "choosing nodes", problem, jobs, places)
    solved = jobs.amplitudes(problem, places, "choosing nodes")
    values_of = functools.partial(_elements, problem.grating) if how.polarised else _unpolarised
    # three variables share the tolerance; rarely seen bands may miss more
    shares, sides = _band_shares(problem.grating, len(drawn)), problem.grating.sides
    return {
        band: _count(
            of_band, most, solved, values_of, how.tolerance / np.sqrt(3 * len(drawn) * share), sides
        )
        for (band, of_band), share in zip(drawn.items(), shares, strict=True)
    }


def _band_shares(grating: Grating, bands: int) -> Real:
    """Return the share of diffuse white light in each band, at least 1/(16 bands).

    If a band of share p misses 1/√(n p) of a tolerance, all n bands together miss the tolerance at
    most (Cauchy and Schwarz).
    """
    x, y, lam = diffuse_light(4096, grating.wavelengths)
    band = cells.to_cell(x, y, lam, grating.optical_period).band
    counted = np.bincount(np.minimum(band, bands - 1), minlength=bands) / len(band)
    return np.maximum(counted, 1.0 / (16 * bands))


def _count(
    drawn: Sequence[Line],
    most: Counts,
    solved: Mapping[Place, Complex],
    values_of: Callable[[Place, Complex], Real],
    error: float,
    sides: int,
) -> Counts:
    """Return the numbers of nodes that all lines of a band need, for values (w, j, q, n)."""
    needed = [1 if size == 1 else least for size, least in zip(most, MIN_NODES, strict=True)]
    for line in drawn:
        if most[line.axis] == 1:
            continue
        values = [values_of(place, solved[place]) for place in line.places]
        if line.axis == 0:
            values += [
                values_of(place, reversed_light(solved[place], sides))
                for place in reversed(line.places)
            ]
        # order 0 is no colour, and is left out
        along = np.concatenate(values)
        if (channels := along.shape[1] // sides) > 1:
            along *= 1.0 - np.tile(np.eye(channels), (sides, sides))[..., None]
        needed[line.axis] = max(needed[line.axis], count_for(along, MIN_NODES[line.axis], error))
    return Counts(*needed)


def _unpolarised(place: Place, amplitudes: Complex) -> Real:
    """Return unpolarised efficiencies (w, j, q, 1)."""
    return powers(amplitudes).mean(axis=-1, keepdims=True)


def _elements(grating: Grating, place: Place, amplitudes: Complex) -> Real:
    """Return ½ M (w, j, q, 16), whose norm is the efficiency, with odd elements over y."""
    y = grating.station(*place).along[:, None, None, None, None]
    elements = 0.5 * mueller_of(amplitudes) * np.where(ODD, 1.0 / y, 1.0)
    return elements.reshape(*elements.shape[:3], 16)


def _band(
    band: int, counts: Counts, solved: Mapping[Place, Complex], polarised: bool, sides: int
) -> Band:
    """Assemble the efficiencies, and Mueller matrices, of a band from its stations."""
    kinds, matrices, places = [], [], places_of(band, counts)
    for kind in kinds_of(band):
        values = at_nodes(kind, places, counts, solved, sides, powers)
        total = values.sum(axis=-2, keepdims=True)
        kinds.append(values / np.maximum(total, 1.0))
        if polarised:
            matrices.append(at_nodes(kind, places, counts, solved, sides, _limited_mueller))
    return Band(band, *kinds, mueller=tuple(matrices) or None)


def _limited_mueller(amplitudes: Complex) -> Real:
    """Return the Mueller matrices of amplitudes, scaled where their powers sum to more than 1."""
    total = powers(amplitudes).sum(axis=2)
    return mueller_of(amplitudes / np.sqrt(np.maximum(total, 1.0))[..., None, None])


def _reciprocity(problem: Problem, jobs: Jobs, bands: Iterable[int]) -> float:
    """Return the largest violation of reciprocity in any band; see `resolution`."""
    places = [Place(band, kind, 0.5, 0.41, (0.5,)) for band in bands for kind in kinds_of(band)]
    solved = jobs.solve(problem, places, "checking reciprocity")
    return reciprocity_error(solved, problem.grating.sides)


def announce_stage(
    announce: Callable[[Estimate], None],
    stage: str,
    problem: Problem,
    jobs: Jobs,
    places: Sequence[Place],
) -> None:
    """Time the stage's middle station and announce the stage."""
    if announce is silent:
        return
    middle = places[len(places) // 2]
    seconds = jobs.seconds(problem, middle) / len(middle.w)
    solutions = sum(len(place.w) for place in places)
    announce(Estimate(stage, len(places), solutions, seconds * solutions))


def silent(estimate: Estimate) -> None:
    """Announce nothing."""
