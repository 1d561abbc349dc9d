"""Numbers of nodes of a table's bands, chosen by series along lines before anything else is solved.

A tolerance that the lines say will not be reached is refused here.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from ...arrays import Complex, Real
from ...errors import DiffractionError
from .. import cells
from ..cells import Counts
from ..polarised import ODD, mueller_of
from ..response import MUELLER, UNPOLARISED
from .accuracy import diffuse_light
from .jobs import Jobs, Problem
from .nodes import MAX_NODES, MIN_NODES, Line, Place, count_for, lines
from .settings import Settings, announce_stage
from .stations import Grating, reversed_light

#: Expected error over the tolerance from which on a solution is refused: lines across bands
#: overestimate it by about as much.
_HOPELESS = 1.5
#: Part of the tolerance that lines of polarised tables keep.
_OF_POLARISED = 0.8


def node_counts(
    problem: Problem,
    jobs: Jobs,
    bands: Iterable[int],
    how: Settings,
) -> dict[int, Counts]:
    """Choose the numbers of nodes of each band by series along lines across it.

    Raises a DiffractionError if as many nodes as are tried will miss the tolerance.
    """
    most = Counts(*MAX_NODES[:2], 1 if problem.grating.is_perfect else MAX_NODES[2])
    drawn = {band: list(lines(band, most)) for band in bands}
    places = [place for of_band in drawn.values() for line in of_band for place in line.places]
    announce_stage("choosing nodes", problem, jobs, places)
    solved = jobs.amplitudes(problem, places, "choosing nodes")
    count = MUELLER if how.polarised else UNPOLARISED
    values_of = functools.partial(_elements, problem.grating, count)
    # three variables share the tolerance; rarely seen bands may miss more. Polarisation changes in
    # more places than two crossings show
    tolerance = (_OF_POLARISED if how.polarised else 1.0) * how.tolerance
    grating, sides = problem.grating, problem.grating.sides
    # Share of diffuse white light in each band, at least 1/(16 bands). If a band of share p misses
    # 1/√(n p) of a tolerance, all n bands together miss the tolerance at most (Cauchy and Schwarz)
    band = cells.to_cell(*diffuse_light(4096, grating.wavelengths), grating.optical_period).band
    counted = np.bincount(np.minimum(band, len(drawn) - 1), minlength=len(drawn)) / len(band)
    shares = np.maximum(counted, 1.0 / (16 * len(drawn)))
    chosen = {
        band: _count(
            of_band, most, solved, values_of, tolerance / np.sqrt(3 * len(drawn) * share), sides
        )
        for (band, of_band), share in zip(drawn.items(), shares, strict=True)
    }
    counts = {band: count for band, (count, _) in chosen.items()}
    missed = np.array([part for _, part in chosen.values()])
    expected = float((shares * missed).sum() / shares.sum())
    if expected > _HOPELESS * how.tolerance:
        worst = int((shares * missed).argmax())
        apart, line = grating.structure.fringes(how.wavelengths[0])
        raise DiffractionError(
            f"the tolerance of {how.tolerance:.2%} will not be reached: {tuple(counts[worst])} "
            f"nodes still miss {missed[worst]:.2%} of the light along lines across band {worst}, "
            f"all bands {expected:.2%}; use a tolerance of {min(expected, 0.2):.2g}, or fewer "
            "wavelengths" + (f"; {line}" if apart < np.inf else "")
        )
    return counts


def _count(
    drawn: Sequence[Line],
    most: Counts,
    solved: Mapping[Place, Complex],
    values_of: Callable[[Place, Complex], Real],
    error: float,
    sides: int,
) -> tuple[Counts, float]:
    """Return the numbers of nodes that all lines of a band need, for values (w, j, q, n).

    And the share of the light that so many nodes miss.
    """
    needed = [1 if size == 1 else least for size, least in zip(most, MIN_NODES, strict=True)]
    missed = [0.0, 0.0, 0.0]
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
        count, left = count_for(along, MIN_NODES[line.axis], error)
        needed[line.axis] = max(needed[line.axis], count)
        missed[line.axis] = max(missed[line.axis], left)
    return Counts(*needed), float(np.linalg.norm(missed))


def _elements(grating: Grating, count: int, place: Place, amplitudes: Complex) -> Real:
    """Return the first elements of ½ M (w, j, q, count), odd ones over y.

    Of all 16 the norm is the efficiency.
    """
    y = grating.station(*place).along[:, None, None, None, None]
    elements = 0.5 * mueller_of(amplitudes) * np.where(ODD, 1.0 / y, 1.0)
    return elements.reshape(*elements.shape[:3], MUELLER)[..., :count]
