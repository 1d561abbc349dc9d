"""Settings of a solution, and the estimates of its stages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ...heights.lengths import count_between, number_between
from .jobs import AUTO, MOST_RESOLUTION, Jobs, Problem, solver_of
from .nodes import AnyPlace
from .resolution import STEP, Chosen, coarsest

#: Wavelengths of a table, nm: the visible.
WAVELENGTHS = (380.0, 780.0)
#: Mean error of interpolation between nodes, of the light in all orders but 0.
TOLERANCE = 0.01
#: Stations that are timed before a stage.
_TIMED = 5
#: Sum over the orders of a solution from which on it is refused; smaller sums above 1, which come
#: of coarse solutions near grazing, are scaled to 1.
MOST_EXCESS = 1.1


class Estimate(NamedTuple):
    """Work of the next stage.

    Attributes
    ----------
    stations, solutions : numbers of stations, and of stations times wavelengths.
    seconds : of a processor.
    size : bytes of the table that the stage makes, or 0.
    """

    stage: str
    stations: int
    solutions: int
    seconds: float
    size: float = 0.0


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
            count_between(self.resolution, "resolution", 3, max(MOST_RESOLUTION.values()))


def header_of(chosen: Chosen, how: Settings) -> dict[str, Any]:
    """Return the entries that the headers of all solved tables have."""
    grating = chosen.problem.grating
    return {
        "solver": solver_of(chosen.problem).name,
        "material": grating.material_text,
        "profile": grating.profile.name,
        "depth": grating.profile.depth,
        "solver_error": chosen.error,
        "tolerance": how.tolerance,
    }


def announce_stage(
    stage: str, problem: Problem, jobs: Jobs, places: Sequence[AnyPlace], size: float = 0.0
) -> None:
    """Time some of the stage's missing stations and announce it; size : of its table, bytes."""
    if jobs.announce is None or not (places := jobs.missing(problem, places)):
        return
    some = places[len(places) // (2 * _TIMED) :: max(len(places) // _TIMED, 1)]
    seconds = sum(jobs.seconds(problem, place) for place in some)
    solutions = sum(len(place.w) for place in places)
    seconds *= solutions / sum(len(place.w) for place in some)
    jobs.announce(Estimate(stage, len(places), solutions, seconds, size))


def announce_comparison(problem: Problem, jobs: Jobs, places: Sequence[AnyPlace]) -> None:
    """Time a solution at the first resolution, and announce the comparison with the next one."""
    if jobs.announce is None:
        return
    first = replace(problem, resolution=problem.resolution or coarsest(problem))
    seconds = jobs.seconds(first, places[0]) / len(places[0].w)
    solutions = sum(len(place.w) for place in places)
    # a solution costs as its matrices: the cube of the resolution
    both = seconds * solutions * (1.0 + STEP**3)
    jobs.announce(Estimate("choosing the resolution", len(places), 2 * solutions, both))
