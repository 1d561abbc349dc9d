"""Energy conservation: a scale of directions by which no more is reflected than comes in.

The model f gains energy on some surfaces at some angles. With the albedo a(ω) of f at one
wavelength, s is sought such that

    f'(ωi, ωo) = f(ωi, ωo) s(ωi) s(ωo)   reflects   s(ωi) ∫ f s cosθo dωo = min(a(ωi), 1):

reciprocal, since s s is symmetric, and with nothing taken from directions that gain nothing, since
their s is a little above 1 where that of their partners is below. That is the scaling of a
symmetric kernel to given sums (Sinkhorn and Knopp 1967), by the iteration s ← s √(min(a, 1)/(s Ms))
with M of `transport`. What is left to do:

- Between the grid's directions and wavelengths an order may appear or vanish (a Rayleigh anomaly).
  So the albedo is looked at between them too, and s fitted there as well (`fit`).
- Gratings have few orders and so the most of both, and they are solved otherwise: by chains of
  directions, on a grid whose nodes lie where orders appear (`chains`, `grating`). So are
  surfaces whose strong orders are a grating's, but without chains.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...optics.fresnel import Filmed
from ..table import DiffractionTable
from .chains import Chains
from .fit import FEW_ORDERS, MANY_ORDERS, SPIKES, Pace, Samples, fitted, limits, parallel
from .gain import Gain, fades
from .grating import Grating, GratingGrid
from .grid import DirectionGrid
from .transport import Orders, Transport

Real = NDArray[np.float64]
Array = NDArray[np.float32]
#: n + ik of the material at wavelengths (n,), nm, or that under a film; None for R = 1.
Index = Callable[[Real], "NDArray[np.complex128] | Filmed | None"]

#: Directions of a scale, whose albedos rise and fall within few degrees of azimuth; of what is
#: looked at, and of the albedo by which it is told whether any is needed.
SCALE, FINE, COARSE = DirectionGrid(40, 120), DirectionGrid(40, 60), DirectionGrid(20, 30)
#: Wavelengths of a scale, without a film and with one, whose fringes albedos follow, and of that
#: albedo; in variants of one wavelength there is one.
WAVELENGTHS, FILM_WAVELENGTHS, COARSE_WAVELENGTHS = 8, 16, 4
#: Nodes of a grating's scale, as in `Grating`: at least; and at most, of Kirchhoff's steep albedos
#: or of tracks, with weak orders beside it, as many as so many rows have: more than is looked at
#: would be too many.
NODES, MOST_NODES, SPIKES_ROWS, TRACK_ROWS = 12, 16, 160, 120
#: Nothing is scaled where the albedo is at most this: the rest is for what lies between directions.
TARGET = 0.99
#: Sweeps until nothing changes any more.
UNTIL_BEST = 40
#: s is at most this up to 70°, and from 80° at most 1: there part of a lobe is below the horizon,
#: which would ask for any, and what is above reaches across directions of very different s.
LARGEST = 1.5
#: Parts of a cell of `SCALE` that are looked at, polar and azimuthal; of one of `FINE` for a scale
#: along the tracks of a surface, of one wavelength and of many, which look at the same nodes;
#: albedos of directions that mirror each other in the tracks' plane differ by less.
ACROSS, ALONG, EVEN = (1, 2), (5, 3), 0.01


@dataclass(frozen=True)
class DirectionalTable:
    """A function of wavelength and direction.

    Attributes
    ----------
    wavelengths : (n,) nm, evenly in their logarithm.
    values : (n, polar + 1, azimuthal) on a `DirectionGrid`, or (n, rows, rows) on a `GratingGrid`.
    grating : of the latter.
    """

    wavelengths: Real
    values: Array
    grating: Grating | None = None

    @property
    def grid(self) -> DirectionGrid:
        """Where the values are, if they are no grating's."""
        assert self.grating is None
        return DirectionGrid(self.values.shape[1] - 1, self.values.shape[2])

    def grid_at(self, wavelength: float) -> DirectionGrid | GratingGrid:
        """Where they are at a wavelength (nm)."""
        if self.grating is None:
            return self.grid
        return GratingGrid(self.grating, self.values.shape[1], wavelength)

    def at(self, theta: ArrayLike, phi: ArrayLike, wavelength: float) -> Array:
        """Trilinear, at angles (rad) of any one shape and a wavelength (nm)."""
        return self.grid_at(wavelength).interpolation(theta, phi)(self.page(wavelength))

    def on(self, grid: DirectionGrid) -> DirectionalTable:
        """The same on a grid of directions."""
        theta, phi = grid.theta[:, None], grid.phi
        values = np.stack([self.at(theta, phi, float(one)) for one in self.wavelengths])
        return DirectionalTable(self.wavelengths, values)

    def page(self, wavelength: float) -> Array:
        """Values at one wavelength (nm)."""
        place = np.interp(
            np.log(wavelength), np.log(self.wavelengths), np.arange(len(self.wavelengths))
        )
        low = int(min(place, len(self.wavelengths) - 2)) if len(self.wavelengths) > 1 else 0
        high = min(low + 1, len(self.wavelengths) - 1)
        share = np.float32(place - low)
        return np.asarray(self.values[low] * (1 - share) + self.values[high] * share, np.float32)


@dataclass(frozen=True)
class Conservation:
    """What a surface reflects, and what is taken of it.

    Attributes
    ----------
    albedo : of the model as it is.
    scale : s, or None where the albedo is at most 1; what Kirchhoff's is scaled from is faded
        (`gain.fade`).
    """

    albedo: DirectionalTable
    scale: DirectionalTable | None


def conservation(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    wavelength_range: tuple[float, float],
) -> Conservation:
    """Of a table at one height scale: a few seconds where energy is gained.

    Parameters
    ----------
    model : "kirchhoff" or "small_slope".
    index : of the material over that of the medium above it.
    wavelength_range : nm; both ends may be one.
    """
    maps = _Maps(_orders(table, height_scale), model, index)
    low, high = wavelength_range
    albedo = maps.albedo(COARSE, _wavelengths(low, high, COARSE_WAVELENGTHS))
    if albedo.values.max() <= TARGET:
        return Conservation(albedo, None)
    filmed = isinstance(index(albedo.wavelengths), Filmed)
    wavelengths = _wavelengths(low, high, FILM_WAVELENGTHS if filmed else WAVELENGTHS)
    if (grating := maps.orders.grating) is not None:
        most = SPIKES_ROWS // (grating.units(low) + 1) if maps.fades else 0
        nodes = max(NODES, min(MOST_NODES, most))
        return Conservation(albedo, maps.of_chains(replace(grating, nodes=nodes), wavelengths))
    if (grating := maps.tracks(wavelengths)) is not None:
        nodes = min(MOST_NODES, TRACK_ROWS // (grating.units(low) + 1))
        grating = replace(grating, nodes=nodes)
    return Conservation(albedo, maps.of_directions(grating, wavelengths))


def _wavelengths(low: float, high: float, count: int) -> Real:
    return np.geomspace(low, high, count if high > low else 1)


def albedos(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    found: Conservation,
    theta: Real,
    phi: Real,
    wavelength: float,
) -> tuple[Array, Array]:
    """The albedo as it is and as it is conserved, (t, p) each, at angles (rad) and one wavelength.

    Exact sums at these directions, not the grid's: what a furnace finds. Arguments as in
    `conservation`, which gave `found`.
    """
    maps, at = _Maps(_orders(table, height_scale), model, index), np.array([wavelength])
    ones = np.ones((FINE.polar + 1, FINE.azimuthal), np.float32)
    raw = maps.at(at, theta, phi, FINE)[0](ones)
    if found.scale is None:
        return raw, raw
    transport = maps.at(at, theta, phi, found.scale.grid_at(wavelength), maps.fades)[0]
    s = found.scale.at(theta[:, None], phi, wavelength)
    return raw, s * transport(found.scale.page(wavelength))


def most_kept(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    theta: Real,
    phi: Real,
    wavelength: float,
) -> Real:
    """What reciprocity leaves at best of min(a, 1), (t, p); arguments as in `albedos`.

    Of a grating, the share that can be kept of every direction which light goes to and fro between
    with this one: a bound. All directions of other surfaces hang together, and there it is what
    is kept by the s that is best on the directions of `FINE`, interpolated: no bound, but as much
    can be kept there.
    """
    orders = _orders(table, height_scale)
    maps = _Maps(orders, model, index)
    gain = maps.gains(np.array([wavelength]))[0]
    if orders.grating is None:
        at = FINE.theta, FINE.phi, gain, FINE
        aim = np.clip(
            orders.of_gain(*at)(np.ones((FINE.polar + 1, FINE.azimuthal), np.float32)), 1e-6, 1.0
        )
        transport = orders.of_gain(*at, maps.fades)
        s = scaled(transport, aim, np.zeros(1), UNTIL_BEST)
        return FINE.interpolation(theta[:, None], phi)(s * transport(s) / aim).astype(np.float64)
    x, c = orders.grating.along(theta[:, None], phi)
    per_x = gain.wavenumber / orders.grating.spacing
    first, second = per_x * (c - x), per_x * (c + x)
    last = (np.floor(first) + np.floor(second)).astype(int)
    found = np.empty(last.shape)
    for n in np.unique(last):
        at = last == n
        parts = (first[at] % 1.0, second[at] % 1.0)
        found[at] = Chains(orders, orders.grating, gain).most_kept(*parts, int(n))
    return found


def _orders(table: DiffractionTable, height_scale: float) -> Orders:
    """Those last asked for, kept in the table itself: they go with it."""
    last: dict[float, Orders] = table.__dict__.setdefault("_orders", {})
    if height_scale not in last:
        last.clear()
        last[height_scale] = Orders(table, height_scale)
    return last[height_scale]


def scaled(
    transport: Callable[[Any], Any],
    aim: NDArray[np.floating[Any]],
    theta: Real,
    sweeps: int,
) -> Array:
    """s on a grid, whose sums s Ms are `aim`; theta : polar angles, rad, that broadcast to it."""
    s = np.ones_like(aim)
    largest = np.interp(np.degrees(theta), (70.0, 80.0), (LARGEST, 1.0)).astype(np.float32)
    for _ in range(sweeps):
        s = s * np.sqrt(aim / np.maximum(s * transport(s), 1e-6))
        s = np.minimum(s, largest)
    return s


@dataclass(frozen=True)
class _Maps:
    """The maps from weights to albedos."""

    orders: Orders
    model: str
    index: Index
    known: dict[float, Gain] = field(default_factory=dict)

    @property
    def fades(self) -> bool:
        return fades(self.model)

    def at(
        self,
        wavelengths: Real,
        theta: Real,
        phi: Real,
        grid: DirectionGrid | GratingGrid,
        faded: bool = False,
    ) -> list[Transport]:
        """At several wavelengths (nm), for directions, from weights on a grid."""

        def one(gain: Gain) -> Transport:
            return self.orders.of_gain(theta, phi, gain, grid, faded)

        return parallel(one, self.gains(wavelengths))

    def albedo(self, grid: DirectionGrid, wavelengths: Real) -> DirectionalTable:
        """Of the model as it is, on a grid of directions."""
        transports = self.at(wavelengths, grid.theta, grid.phi, grid)
        weights = np.ones((grid.polar + 1, grid.azimuthal), np.float32)
        values = np.stack([transport(weights) for transport in transports])
        return DirectionalTable(wavelengths, values)

    def gains(self, wavelengths: Real) -> list[Gain]:
        """G at several wavelengths (nm), each made once."""
        found = self.index(wavelengths)
        for n, wavelength in enumerate(wavelengths.tolist()):
            index = None if found is None else found[n]
            if wavelength not in self.known:
                self.known[wavelength] = self.orders.gain(wavelength, self.model, index)
        return [self.known[wavelength] for wavelength in wavelengths.tolist()]

    def of_chains(self, grating: Grating, wavelengths: Real) -> DirectionalTable:
        """A grating's s."""
        rows, count = grating.rows(float(wavelengths[0])), grating.nodes

        def one(page: float, wavelength: float, gain: Gain, nodes: bool) -> Samples:
            places = np.arange(0.0, count, 1.0 if nodes else 0.5)
            # longer chains are beyond the horizon at all wavelengths that a page is for
            units = grating.units(float(wavelengths[max(math.ceil(page) - 1, 0)]))
            return Chains(self.orders, grating, gain).samples(rows, units, page, places)

        return self._fitted(_ones(grating, wavelengths), one, FEW_ORDERS)

    def of_directions(self, grating: Grating | None, wavelengths: Real) -> DirectionalTable:
        """s of a surface whose strong orders are a grating's, with weak ones even beside it; or of
        any other.
        """
        table = _ones(grating, wavelengths)
        looked_at, parts = SCALE, ACROSS
        if grating is not None:
            looked_at, parts = FINE, (ALONG[len(wavelengths) > 1],) * 2

        def one(page: float, wavelength: float, gain: Gain, nodes: bool) -> Samples:
            theta, phi = _between(looked_at, *(0, 0) if nodes else parts)
            grid, ones = table.grid_at(wavelength), table.values[0]
            if grating is not None:  # directions that mirror these lie amid them then
                phi = phi + 0.25 * (phi[1] - phi[0])
            found = self.orders.of_gain(theta, phi, gain, grid, self.fades)
            faded = raw = found(ones)
            if self.fades:
                raw = self.orders.of_gain(theta, phi, gain, grid)(ones)
            low, high = limits(raw, np.cos(theta[:, None]), faded)
            return Samples(page, grid.interpolation(theta[:, None], phi), found, low, high)

        return self._fitted(table, one, SPIKES if self.fades else MANY_ORDERS)

    def _fitted(
        self,
        ones: DirectionalTable,
        one: Callable[[float, float, Gain, bool], Samples],
        pace: Pace,
    ) -> DirectionalTable:
        """s at the nodes of a table; one : samples at a page, at nodes or amid them."""
        wavelengths = ones.wavelengths
        pages = np.arange(float(len(wavelengths)))
        single = len(pages) == 1
        between = pages if single else pages[1:] - 0.5
        middle = wavelengths if single else np.sqrt(wavelengths[1:] * wavelengths[:-1])
        given = [
            (*each, nodes)
            for at, lengths, nodes in ((pages, wavelengths, True), (between, middle, False))
            for each in zip(at, lengths, self.gains(lengths), strict=True)
        ]
        samples = parallel(lambda each: one(*each), given)
        return replace(ones, values=fitted(ones.values, samples, pace))

    def tracks(self, wavelengths: Real) -> Grating | None:
        """The grating of all strong orders, if the weak ones, too, reflect evenly beside it."""
        grating = self.orders.tracks
        if grating is None:
            return None
        albedo = self.albedo(FINE, wavelengths[[0, -1]])
        mirrored = 2.0 * np.arctan2(grating.axis[1], grating.axis[0]) - FINE.phi
        theta = FINE.theta[FINE.theta <= np.radians(80.0), None]
        one, other = (
            np.stack([albedo.at(theta, phi, float(at)) for at in albedo.wavelengths])
            for phi in (FINE.phi, mirrored)
        )
        return grating if np.abs(one - other).max() <= EVEN else None


def _ones(grating: Grating | None, wavelengths: Real) -> DirectionalTable:
    """On a grating's nodes, or on `SCALE`."""
    rows = grating.rows(float(wavelengths[0])) if grating else 0
    shape = (rows, rows) if grating else (SCALE.polar + 1, SCALE.azimuthal)
    return DirectionalTable(wavelengths, np.ones((len(wavelengths), *shape), np.float32), grating)


def _between(grid: DirectionGrid, polar: int, azimuthal: int) -> tuple[Real, Real]:
    """Middles of so many parts of all cells: polar angles and azimuths; for none, the nodes."""
    if polar == 0:
        return grid.theta, grid.phi
    low, high = grid.theta[:-1, None], grid.theta[1:, None]
    theta = low + (high - low) * ((np.arange(polar) + 0.5) / polar)
    count = grid.azimuthal * azimuthal
    phi: Real = (np.arange(count, dtype=float) + 0.5) * (2.0 * np.pi / count)
    return theta.ravel(), phi
