"""Resolution of a solver, chosen by its convergence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Real
from ...errors import DiffractionError
from .chandezon import stretched_period
from .jobs import CROSSED, MOST_RESOLUTION, Jobs, Problem
from .nodes import AnyPlace, Place, kinds_of
from .stations import reversed_light

#: Factor between resolutions that are compared, and comparisons at most.
STEP, _MOST = 1.35, 12
#: Light from nothing that a solution may have where resolutions are compared, or a tenth of the
#: tolerance if that is more: the table scales it away, which changes colours by as much.
_EXCESS = 5e-4
#: Reflected share of light, on average, below which there are no efficiencies to tabulate.
_DARK = 1e-7
#: Points for each wavelength in the material, at first; meshes graded at corners are half as fine
#: between them.
_POINTS_PER_WAVELENGTH = 2.5
_FEWEST_POINTS, _POINTS_PER_CORNER = 48, 12
#: Harmonics on either side beyond the orders that propagate, at first; least of crossed gratings.
_HARMONICS, _FEWEST_CROSSED = 8, 3


#: Incident ports of a place's station whose light is compared.
Ports = Mapping[AnyPlace, Sequence[int]]


class Chosen(NamedTuple):
    """Problem with a resolution, and its error: the change to the next resolution."""

    problem: Problem
    error: float


def resolved(
    problem: Problem,
    jobs: Jobs,
    places: Sequence[AnyPlace],
    tolerance: float,
    ports: Ports | None = None,
) -> Chosen:
    """Return a problem with its error.

    A resolution of 0 is raised until the next one changes the light in orders by `tolerance` at
    most.

    places : where resolutions are compared, such as `places_to_test`.
    ports : whose light is compared; None compares all. Long periods have hundreds in a station, of
        which those at grazing incidence converge last.

    Raises a DiffractionError if it does not converge, or the grating reflects nothing.
    """
    given, text = problem.resolution, "choosing the resolution"
    coarse = replace(problem, resolution=given or coarsest(problem))
    values = jobs.solve(coarse, places, "checking the resolution" if given else text)
    for number in range(_MOST):
        if number and _finer(coarse) > MOST_RESOLUTION[problem.method]:
            break
        fine = finer_problem(coarse)
        finer = jobs.solve(fine, places, text)
        lit = incident(values, ports)
        after = incident(finer, ports)
        error = _changed(problem, [(lit[place], after[place]) for place in places])
        if given:
            return Chosen(problem, error)
        excess = max(float(each.sum(axis=(3, 4)).max()) for each in lit.values()) - 1.0
        if problem.grating.thin:  # which loses no light either
            excess = energy_error(lit.values())
        one_way = reciprocity_error(values, problem.grating.sides, ports)
        allowed = max(_EXCESS, 0.1 * tolerance)
        if error <= tolerance and excess <= allowed and one_way <= 2 * tolerance:
            return Chosen(coarse, error)
        coarse, values = fine, finer
    raise DiffractionError(
        f"method {problem.method} does not converge on {problem.grating.profile.name}: at "
        f"resolution {coarse.resolution} the last step changed {error:.2%} of the light, sums over "
        f"orders are above 1 by {max(excess, 0.0):.2%}, and reversed light differs by "
        f"{one_way:.2%}; smooth the profile, use a larger tolerance or another method, or set "
        "the resolution"
    )


def incident(solved: Mapping[Any, Real], ports: Ports | None) -> dict[Any, Real]:
    """Return the efficiencies (w, j, 2, q, 2) of light that is incident in some ports j."""
    if ports is None:
        return dict(solved)
    return {place: values[:, ports[place]] for place, values in solved.items()}


def _changed(problem: Problem, values: Sequence[tuple[Real, Real]]) -> float:
    """Return the share of the light that changes from one resolution to the next.

    values : efficiencies of both, of each place.

    Raises a DiffractionError if the grating reflects nothing.
    """
    missed = sum(float(np.abs(after - before).sum()) for before, after in values)
    light = sum(float(after.sum()) for _, after in values)
    if light < _DARK * sum(after.shape[1] for _, after in values):
        raise DiffractionError(
            f"{problem.grating.profile.name} of {problem.grating.material_text} reflects no "
            "light; choose materials that differ from the medium above, and layers that light "
            "passes"
        )
    return max(missed / light, float(np.finfo(np.float32).eps))  # jobs return single precision


def finer_problem(problem: Problem) -> Problem:
    """Return the problem at the next resolution."""
    return replace(problem, resolution=_finer(problem))


def _finer(problem: Problem) -> int:
    """Return the next resolution; of crossed gratings the cost rises with its seventh power."""
    if problem.method == CROSSED:
        return problem.resolution + 1
    return int(np.ceil(problem.resolution * STEP))


def places_to_test(bands: Sequence[int]) -> list[Place]:
    """Return places where resolutions are compared; resonances of metals lie in low bands."""
    some = sorted({*bands[:2], bands[len(bands) // 2], bands[-1]})
    return [
        Place(band, kind, tau, 0.41, (0.05, 0.95))
        for band in some
        for kind, tau in zip(kinds_of(band), (0.5, 0.2), strict=False)
    ]


def reciprocity_error(solved: Mapping[Any, Real], sides: int, ports: Ports | None = None) -> float:
    """Return the largest violation of reciprocity, unpolarised, at the places of t = ½.

    They are their own reverse: a solver that conserves reciprocity has none. It is the share of the
    light of one channel, summed over the outgoing ones; 0 without such places.
    """
    differences = {
        place: np.abs(values - reversed_light(values, sides))
        for place, values in solved.items()
        if isinstance(place, Place) and place.tau == 0.5
    }
    lit = incident(differences, ports).values()
    sums = (float(each.sum(axis=-1).mean(axis=2).sum(axis=-1).max()) for each in lit)
    return max(sums, default=0.0)


def energy_error(solved: Iterable[Real]) -> float:
    """Return the mean difference from 1 of the sums over the orders of a clear sheet."""
    return float(np.mean([np.abs(values.sum(axis=(3, 4)) - 1.0).mean() for values in solved]))


def coarsest(problem: Problem) -> int:
    """Return the resolution to begin with, which shows where efficiencies vary."""
    grating = problem.grating
    low, high = grating.wavelengths
    if problem.method == CROSSED:
        return max(int(2e3 * grating.profile.period / low) + 1, _FEWEST_CROSSED)
    profile = grating.line
    lam = np.linspace(low, high, 32)
    index = grating.material.index(lam)
    dense = np.maximum(grating.superstrate, 0.0 if index is None else np.abs(index))
    waves = float((1e3 * dense / lam).max())  # per µm
    if problem.method in ("coupled", "chandezon"):
        # a sheet's orders within its material count, too
        per_period = waves if grating.thin else grating.superstrate * 1e3 / low
        least = int(np.ceil(profile.period * per_period)) + _HARMONICS
        if problem.method == "coupled":
            return least
        # waves along the steepest facet, as coordinates stretch it
        return max(least, int(np.ceil(stretched_period(profile) * per_period)))
    sides = 2.0 if profile.corners else 1.0
    points = _POINTS_PER_WAVELENGTH * sides * profile.length * waves
    # the sums over orders of half as many terms must reach the waves in the material
    return int(
        np.ceil(
            max(points, _FEWEST_POINTS, _POINTS_PER_CORNER * profile.corners,
                2.2 * profile.period * waves)
        )
    )  # fmt: skip
