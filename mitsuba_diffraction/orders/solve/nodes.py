"""Numbers of nodes along τ, ρ and w that a tolerance requires, from lines across a band.

Along a line through the band the efficiencies are solved at many Chebyshev nodes; their series says
what fewer nodes leave out. Resonances of metals (surface plasmons) lie beside the ends of kind B in
low bands, which need several times as many nodes as high ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from ...arrays import Complex, Real
from .. import cells
from ..cells import Counts
from .stations import Grating, reversed_light

#: Numbers of nodes along τ, ρ and w that are tried, from which the series are taken at most. Along
#: w a line is one station, and gold's index changes quickly.
MAX_NODES = (48, 40, 24)
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


def kinds_of(band: int) -> tuple[int, ...]:
    """Return the kinds of a band: A, and, but for band 0, B."""
    return (cells.A, cells.B) if band else (cells.A,)


def places_of(band: int, counts: Counts, nodes: Callable[[int], Real] = cells.nodes) -> list[Place]:
    """Return the stations of a band: up to τ = ½, of which reciprocity makes the other half."""
    tau, rho, w = (nodes(count).tolist() for count in counts)
    half = tau[: (counts.tau + 1) // 2]
    return [Place(band, kind, t, r, tuple(w)) for kind in kinds_of(band) for t in half for r in rho]


class CrossedPlace(NamedTuple):
    """Light of a crossed grating, which its station is of; w : the wavelength, nm, alone."""

    x: float
    y: float
    w: tuple[float, ...]


AnyPlace = Place | CrossedPlace


class Located(NamedTuple):
    """Light of one direction and wavelength.

    Attributes
    ----------
    place : station of which the light is solved.
    port : among the station's channels.
    orders : (q, 2) by which the light leaves through these channels.
    """

    place: AnyPlace
    port: int
    orders: NDArray[np.int64]


#: Factor on wavelengths that tells cells: where two orders graze at once, on both sides, it makes
#: both propagate.
_SHORTER = 1.0 - 1e-10


def located(grating: Grating, x: Real, y: Real, wavelength: Real) -> list[Located]:
    """Return the stations of some lights (n,), by their mirror directions and wavelengths, nm."""
    if grating.cell is not None:
        lights = zip(*(part.tolist() for part in (x, y, wavelength)), strict=True)
        stations = [grating.crossed_station(*light) for light in lights]
        return [
            Located(
                CrossedPlace(station.x, station.y, (lam,)),
                int(np.flatnonzero(~station.orders.any(axis=1))[0]),
                station.orders,
            )
            for station, lam in zip(stations, wavelength.tolist(), strict=True)
        ]
    cell = cells.to_cell(x, y, wavelength * _SHORTER, grating.optical_period)
    w = cells.w_of(cell.k_continuous, wavelength, grating.wavelengths, grating.optical_period)
    columns = (part.tolist() for part in (*cell[:2], cell.channel, cell.channels, *cell[3:5], w))
    return [
        Located(
            Place(band, kind, tau, rho, (at,)), j,
            np.column_stack([j - np.arange(count), np.zeros(count, np.int64)]),
        )
        for band, kind, j, count, tau, rho, at in zip(*columns, strict=True)
    ]  # fmt: skip


def at_nodes(
    kind: int,
    places: Sequence[Place],
    counts: Counts,
    solved: Mapping[Place, Complex],
    sides: int,
    values_of: Callable[[Complex], Real],
) -> NDArray[np.float32]:
    """Return values (w, j, q, …) of amplitudes at all nodes of a kind, (τ, ρ, w, j, q, …).

    places : of a band, of `places_of`.
    """
    of_kind = [place for place in places if place.kind == kind]
    shape = values_of(solved[of_kind[0]]).shape
    values = np.empty((counts.tau, counts.rho, *shape), np.float32)
    for number, place in enumerate(of_kind):
        n, m = divmod(number, counts.rho)
        values[n, m] = values_of(solved[place])
        back = values_of(reversed_light(solved[place], sides))
        opposite = counts.tau - 1 - n
        values[opposite, m] = back if opposite > n else 0.5 * (values[n, m] + back)
    return values


class Line(NamedTuple):
    """Places along one variable (0 τ, 1 ρ, 2 w) of a kind, at Chebyshev nodes."""

    axis: int
    places: tuple[Place, ...]


def lines(band: int, most: tuple[int, int, int] = MAX_NODES) -> Iterator[Line]:
    """Yield the lines on which a band's numbers of nodes are chosen.

    Along τ, half of the nodes are enough: reciprocity gives the others.
    """
    for kind in kinds_of(band):
        for tau, rho, w in _CROSSINGS:
            half = cells.nodes(most[0])[: most[0] // 2]
            yield Line(0, tuple(Place(band, kind, float(t), rho, (w,)) for t in half))
            across = cells.nodes(most[1])
            yield Line(1, tuple(Place(band, kind, tau, float(r), (w,)) for r in across))
            yield Line(2, (Place(band, kind, tau, rho, tuple(cells.nodes(most[2]))),))


class Needed(NamedTuple):
    """Number of nodes along a line, and the share of the light that their interpolation misses."""

    nodes: int
    missed: float


def count_for(values: NDArray[np.float64], fewest: int, error: float) -> Needed:
    """Return the number of nodes whose interpolation misses `error` of the light at most.

    values : (nodes, j, q, n) at Chebyshev nodes, whose norm over n is the unpolarised efficiency.

    The terms that a number of nodes leaves out, and as much again for those it takes for lower
    ones, are summed over q and averaged over j. Where even all nodes miss more, the last term says
    by how much.
    """
    terms = dct(values, axis=0) / len(values)
    light = max(float(np.linalg.norm(values, axis=-1).sum(axis=-1).mean()), 1e-12)
    missed = np.inf
    for count in range(fewest, len(values)):
        left = np.sqrt(np.sum(terms[count:] ** 2, axis=(0, -1)))
        missed = float(left.sum(axis=-1).mean()) / light
        if missed <= error:
            return Needed(count, missed)
    return Needed(len(values), missed)
