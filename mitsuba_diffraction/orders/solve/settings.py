"""Settings of a solution, and the estimates of its stages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Complex
from ...errors import DiffractionError
from ...heights.lengths import count_between, number_between
from .jobs import AUTO, MOST_RESOLUTION, Jobs, Problem, Spot, solver_of
from .nodes import AnyPlace
from .resolution import Chosen, Ports, finer_problem, incident

#: Wavelengths of a table, nm: the visible.
WAVELENGTHS = (380.0, 780.0)
#: Mean error of interpolation between nodes, of the light in all orders but 0.
TOLERANCE = 0.01
#: Stations that are timed before a stage.
_TIMED = 5
#: Sum over the orders of a solution from which on it is refused; smaller sums above 1, which come
#: of coarse solutions near grazing, are scaled to 1.
MOST_EXCESS = 1.1
#: Times that the resolution is raised, if solutions have light from nothing.
_RAISED = 3


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
    stage: str, problem: Problem, jobs: Jobs, places: Sequence[AnyPlace], size: float = 0.0,
    cost: float = 1.0,
) -> None:  # fmt: skip
    """Solve some of the stage's missing stations, and announce the time of all.

    size : of the table, bytes; cost : of the stage, over its cost if all is solved once.
    """
    if jobs.announce is None or not (places := jobs.missing(problem, places)):
        return
    some = places[len(places) // (2 * _TIMED) :: max(len(places) // _TIMED, 1)]
    before = jobs.processor_seconds
    jobs.amplitudes(problem, some, "estimating the time")
    solutions = sum(len(place.w) for place in places)
    each = (jobs.processor_seconds - before) / sum(len(place.w) for place in some)
    jobs.announce(Estimate(stage, len(places), solutions, cost * each * solutions, size))


def solved_stage(
    problem: Problem, jobs: Jobs, places: Sequence[Spot], size: float, ports: Ports | None = None
) -> tuple[Problem, dict[Spot, Complex]]:
    """Solve places of a table, at a higher resolution if solutions have light from nothing.

    size : of the table, bytes; ports : whose light is asked for, see `resolution.resolved`.

    Raises a DiffractionError if they still have.
    """
    for _ in range(_RAISED):
        announce_stage("solving", problem, jobs, places, size)
        solved = jobs.amplitudes(problem, places, "solving orders")
        lit = incident({place: np.abs(values) ** 2 for place, values in solved.items()}, ports)
        excess = max(float(values.sum(axis=(3, 4)).max()) for values in lit.values())
        if excess <= MOST_EXCESS:
            return problem, solved
        problem = finer_problem(problem)
    raise DiffractionError(
        f"efficiencies of a solution sum to {excess:.4g}, also at resolution {problem.resolution}; "
        "use another method, a higher resolution, or a smoother profile"
    )
