"""Numbers of nodes along τ, ρ and w that a tolerance requires, from lines across a band.

Along a line through the band the efficiencies are solved at many Chebyshev nodes; their series says
what fewer nodes leave out. Resonances of metals (surface plasmons) lie beside the ends of kind B in
low bands, which need several times as many nodes as high ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from ..tables.orders import cells

#: Numbers of nodes along τ, ρ and w that are tried, from which the series are taken at most.
MAX_NODES = (36, 24, 8)
MIN_NODES = (4, 3, 2)
#: Where a band's lines cross (τ, ρ, w): away from its middle, where symmetry would hide odd terms.
_CROSSINGS = ((0.31, 0.38, 0.35), (0.69, 0.72, 0.7))


class Place(NamedTuple):
    """Station of a table: its band, kind, τ and ρ; and the w (n,) that are solved there."""

    band: int
    kind: int
    tau: float
    rho: float
    w: tuple[float, ...]


class Line(NamedTuple):
    """Places along one variable (0 τ, 1 ρ, 2 w) of a kind, at Chebyshev nodes."""

    axis: int
    places: tuple[Place, ...]


def lines(band: int, most: tuple[int, int, int] = MAX_NODES) -> Iterator[Line]:
    """Yield the lines on which a band's numbers of nodes are chosen.

    Along τ, half of the nodes are enough: reciprocity gives the others.
    """
    for kind in (cells.A, cells.B) if band else (cells.A,):
        for tau, rho, w in _CROSSINGS:
            half = cells.nodes(most[0])[: most[0] // 2]
            yield Line(0, tuple(Place(band, kind, float(t), rho, (w,)) for t in half))
            across = cells.nodes(most[1])
            yield Line(1, tuple(Place(band, kind, tau, float(r), (w,)) for r in across))
            yield Line(2, (Place(band, kind, tau, rho, tuple(cells.nodes(most[2]))),))


def count_for(values: NDArray[np.float64], fewest: int, error: float) -> int:
    """Return the number of nodes whose interpolation misses `error` of the light at most.

    values : (nodes, j, q, n) at Chebyshev nodes, whose norm over n is the unpolarised efficiency.

    The terms that a number of nodes leaves out, and as much again for those it takes for lower
    ones, are summed over q and averaged over j.
    """
    terms = dct(values, axis=0) / len(values)
    light = max(float(np.linalg.norm(values, axis=-1).sum(axis=-1).mean()), 1e-12)
    for count in range(fewest, len(values)):
        left = np.sqrt(np.sum(terms[count:] ** 2, axis=(0, -1)))
        if float(left.sum(axis=-1).mean()) <= error * light:
            return count
    return len(values)
