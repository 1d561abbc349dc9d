"""Places where light is solved: at the nodes of a table's bands, and of single lights."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex, Real
from .. import cells
from ..cells import Counts
from .stations import Grating, reversed_light


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
