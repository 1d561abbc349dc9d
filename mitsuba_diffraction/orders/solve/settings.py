"""Settings of a solution, and the estimates of its stages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...heights.lengths import count_between, number_between
from .films import material_text
from .jobs import AUTO, MOST_RESOLUTION, Jobs, Problem, solver_of
from .nodes import Place
from .resolution import Chosen

#: Wavelengths of a table, nm: the visible.
WAVELENGTHS = (380.0, 780.0)
#: Mean error of interpolation between nodes, of the light in all orders but 0.
TOLERANCE = 0.01
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
