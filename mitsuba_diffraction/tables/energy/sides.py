"""R + T of a dielectric surface, and scales of directions on both sides that make it 1.

A lossless dielectric sends all light on. What first order gains or lacks is order 0's: orders are
right to second order in the heights, and order 0, ∝ |a_0|² alone, is not. So c is sought on the
directions of both sides such that with f = f_0 + f_orders

    f'(ωi, ωo) = f_orders + f_0 c(ωi) c(ωo)   sends on   R + T near 1,

as in `conservation`, but upwards too. A sheet loses what is beyond its critical angle; that is put
back likewise. Where order 0 is too weak, as of rough surfaces, all of f' is scaled by s(ωi) s(ωo)
besides, evenly in proportion to what there is.

What is missing after that, m(ω), may be missing along a direction and not along the one that order
0 goes to, as on a blazed grating: no reciprocal model can give it to order 0. It is spread over all
directions where some is missing, which is reciprocal and sums to m (Kulla and Conty 2017):

    f'' = f' + g(ωi) g(ωo),   g = m/√M,   M = ∫ m n² cosθ dω over both sides.

Sums as in `transport`, over the links of a side with a side.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...optics.geometry import wavenumber
from ..sampling import OrderMixture
from ..table import DiffractionTable
from . import between, sheet
from .chains import Chains, put, taken
from .conservation import DirectionalTable
from .fit import parallel
from .gain import bilinear
from .grating import Grating, GratingGrid, fractions
from .grid import DirectionGrid, Interpolation
from .links import Link, Medium
from .sheet import ChainSides, LinkGain
from .sums import LEAST, LinkedSums, solved
from .transport import Orders, Row, Transport

Real = NDArray[np.float64]
Array = NDArray[np.float32]

#: Directions on either side, of a sheet and of a dielectric, whose critical angle is all but one of
#: the latter; and wavelengths. In variants of one there is one.
SHEET, DENSE, WAVELENGTHS = DirectionGrid(48, 96), DirectionGrid(60, 96), (9, 14)
#: Directions of a sheet that is a grating and lacks light that is to be spread.
FINER = DirectionGrid(80, 160)
#: More of gratings. Chains of directions are solved of those whose orders are further apart than
#: the first of these, in 1/σ, and the shortest waves' horizon further off than the second: lobes
#: are narrow at 75°, too. Of their grid what `Grating` says of nodes, and the most units.
NARROW, PLACES, MOST_UNITS = (25.0, 150.0), (14, 0.94), 24
#: Shares of the way to the next nodes at which cells are looked at, the last one where it is above
#: the horizon.
EARLIER = (0.125, 0.25, 0.375, 0.5)
#: Polar angles and azimuths of integrals over a side.
NODES_OF_INTEGRALS = 240, 96


@dataclass(frozen=True)
class SideGrid(DirectionGrid):
    """A grid by `Medium.angle` of a side."""

    medium: Medium
    side: int

    @property
    def angles(self) -> Real:
        """Polar angles, rad."""
        return np.arccos(self.medium.cosine(self.side, self.theta))

    def interpolation(self, theta: ArrayLike, phi: ArrayLike) -> Interpolation:
        return super().interpolation(self.medium.angle(self.side, np.cos(theta)), phi)


@dataclass(frozen=True)
class BothSides(LinkedSums):
    """From weights (2, polar + 1, azimuthal) of directions to R + T (2, t, p).

    Attributes
    ----------
    parts : of either side, what goes to which side.
    """

    parts: list[list[tuple[int, Transport]]]

    def __call__(self, s: Array) -> Array:
        return self._sums(lambda link, weights: link(weights), s)

    def zeroth(self, s: Array) -> Array:
        return self._sums(lambda link, weights: link.glossy * link.mirror(weights), s)

    def _sums(self, of_link: Callable[[Transport, Array], Array | Real], s: Array) -> Array:
        sums = [sum(of_link(link, s[left]) for left, link in side) for side in self.parts]
        return np.asarray(np.stack(sums), np.float32)


class Sides:
    """A table's surface at one height scale, of one dielectric; side 0 is above, 1 below."""

    def __init__(self, table: DiffractionTable, height_scale: float, medium: Medium) -> None:
        self._table, self._height_scale, self._medium = table, height_scale, medium
        # κ of light that stays within is larger by the index
        self._orders = Orders(table, height_scale * medium.index, MOST_UNITS)
        self._flat = copy.copy(self._orders)
        self._flat.mixture, self._flat.has_weak = _level(self._orders.mixture), False
        self._links = medium.links()
        self._use(SHEET if medium.thin else DENSE)

    def _use(self, grid: DirectionGrid) -> None:
        self._grid, shape = grid, (grid.polar, grid.azimuthal)
        self._grids = self._sides_of(shape)
        self._ones = np.ones((2, shape[0] + 1, shape[1]), np.float32)
        self._parts: dict[tuple[Link, bytes], Real] = {}

    def _sides_of(self, shape: tuple[int, int]) -> list[SideGrid]:
        return [SideGrid(*shape, self._medium, side) for side in (0, 1)]

    def scale(self, wavelength_range: tuple[float, float]) -> list[DirectionalTable] | None:
        """c above and below, then s, then g, if needed; None where R + T is near 1 as it is.

        A second or two. Their polar angles are `Medium.angle`.
        """
        low, high = wavelength_range
        grating = self._grating
        count = WAVELENGTHS[self._orders.grating is not None] if high > low else 1
        wavelengths = np.geomspace(low, high, count)
        at = partial(self._scale_of_chains, grating) if grating else self._scale_at
        found = np.stack(parallel(at, wavelengths.tolist()), axis=1)
        if np.all(found == 1.0):
            return None
        needed = found if np.any(found[2:] != 1.0) else found[:2]
        middle = np.sqrt(wavelengths[1:] * wavelengths[:-1]) if count > 1 else wavelengths
        cells = parallel(partial(self._cells, grating), middle.tolist())
        values = between.lowered(needed, cells)
        rooms = between.rooms(values, cells)
        if between.is_lacking(rooms, cells):
            if grating is None and self._grid is SHEET and self._orders.grating is not None:
                finer = copy.copy(self)
                finer._use(FINER)
                return finer.scale(wavelength_range)
            if len(values) == 2:
                values = np.concatenate([values, np.ones_like(values)])
            pages = zip(wavelengths.tolist(), values.swapaxes(0, 1), strict=True)
            room = parallel(lambda one: self._room(grating, *one), list(pages))
            most = np.stack(room, axis=1)
            wanted = np.maximum(most - (between.CEILING - LEAST), 0.0)
            lack = between.fitted(wanted, most, cells, rooms)
            values = np.concatenate([values, self._spread(wavelengths, lack, grating)])
        return [DirectionalTable(wavelengths, one, grating) for one in values]

    def _room(self, grating: Grating | None, wavelength: float, pages: Array) -> Array:
        """What R + T is below `between.CEILING` at the nodes of c and s."""
        if grating is None:
            theta = [grid.angles for grid in self._grids]
            transport = self.transport(theta, self._grid.phi, wavelength)
            return between.excess_and_room(transport, pages, pages)[1]
        found = np.zeros_like(pages[:2])
        for last, sums in enumerate(self._by_length(grating, wavelength)):
            own = np.stack([taken(one, last, grating.nodes) for one in pages])
            room = between.excess_and_room(sums, own, own)[1]
            for side in (0, 1):
                put(found[side], room[side], last)
        return found

    def _spread(self, wavelengths: Real, lack: Array, grating: Grating | None) -> Array:
        """g from m."""
        tables = [DirectionalTable(wavelengths, one, grating) for one in lack]
        totals = np.array([sum(gathered(tables, self._medium, k)) for k in wavelengths.tolist()])
        scale = 1.0 / np.sqrt(np.maximum(totals, 1e-12))
        return np.asarray(lack * scale[:, None, None], np.float32)

    def _cells(self, grating: Grating | None, wavelength: float) -> between.Cells:
        if grating is not None:
            shares = [_amid(grating, wavelength, last) for last in range(self._units(grating) + 1)]
            return between.ChainCells(self._by_length(grating, wavelength, shares), shares)
        halves = [replace(grid, polar=2 * self._grid.polar).angles[1::2] for grid in self._grids]
        rows = int(np.sum(np.any(np.stack(halves) <= between.FALLS[1], axis=0)))
        phi = self._grid.phi + np.pi / self._grid.azimuthal
        angles = np.stack(halves)[:, :rows]
        transport = self.transport(list(angles), phi, wavelength)
        return between.GridCells(transport, angles, self._grid.polar)

    def _scale_at(self, wavelength: float) -> Array:
        """(4, polar + 1, azimuthal)."""
        theta = [grid.angles for grid in self._grids]
        transport = self.transport(theta, self._grid.phi, wavelength)
        return solved(transport, self._ones, np.stack(theta)[..., None])

    @property
    def _grating(self) -> Grating | None:
        """Whose chains are solved, if lobes are narrow against the nodes of its grid."""
        grating = self._orders.grating
        if grating is None or not self._medium.thin:
            return None
        k = float(wavenumber(self._table.wavelength_range[0]))
        widths = np.array([grating.spacing, k]) * self._orders.sigma
        if not np.all(widths > NARROW):
            return None
        return Grating(grating.axis, grating.spacing, *PLACES)

    def _scale_of_chains(self, grating: Grating, wavelength: float) -> Array:
        """(4, rows, rows) at the nodes of a `GratingGrid`."""
        found = self._by_length(grating, wavelength)
        rows = grating.nodes * len(found)
        values = np.ones((4, rows, rows), np.float32)
        for last, sums in enumerate(found):
            ones = np.ones((2, *sums.angle.shape))
            for page, scale in zip(values, solved(sums, ones, sums.angle), strict=True):
                put(page, scale, last)
        return values

    def _by_length(
        self, grating: Grating, wavelength: float, shares: Sequence[Real] | None = None
    ) -> list[ChainSides]:
        """All chains from 1 direction of either side on, at nodes or shares beyond them."""
        chains, found = self._chains(grating, wavelength), []
        for last in range(self._units(grating) + 1):
            first, second = _places(grating, 0.0 if shares is None else shares[last])
            found.append(ChainSides(chains, first, second, last))
        return found

    def _units(self, grating: Grating) -> int:
        return grating.units(self._table.wavelength_range[0])

    def _chains(self, grating: Grating, wavelength: float) -> list[list[tuple[int, Chains]]]:
        """Those of every link, of either side."""
        k = float(wavenumber(wavelength))
        theta = np.linspace(0.0, 0.5 * np.pi, sheet.POLAR)
        chains: list[list[tuple[int, Chains]]] = [[], []]
        for link in self._links:
            orders = self._flat if link.flat else self._orders
            table = link.tables(
                self._parts_of(link, theta), theta, k, self._table, self._height_scale
            )
            gain = LinkGain(link, table, k, orders.mixture.kappa_step / k)
            chains[link.came].append((link.left, Chains(orders, grating, gain, link.sign)))
        return chains

    def sums(
        self, scale: Sequence[DirectionalTable] | None, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Array, Array]:
        """R + T as it is and scaled, (2, t, p) each, of light from above and from below.

        Exact sums at these angles (rad), not the grid's; nm.
        """
        raw = self.transport([theta, theta], phi, wavelength)(self._ones)
        if scale is None:
            return raw, raw
        pages = [one.page(wavelength) for one in scale]
        here = [self.at(one, n % 2, theta[:, None], phi, wavelength) for n, one in enumerate(scale)]
        transport = self.transport([theta, theta], phi, wavelength, scale[0])
        changed = transport.changed(np.stack(pages[:2]), np.stack(here[:2]))
        if len(pages) == 2:
            return raw, np.asarray(changed(np.ones_like(pages[:2])), np.float32)
        found = np.stack(here[2:4]) * changed(np.stack(pages[2:4]))
        return raw, np.asarray(found + self.spread(scale, theta, phi, wavelength), np.float32)

    def spread(
        self, scale: Sequence[DirectionalTable] | None, theta: Real, phi: Real, wavelength: float
    ) -> Array:
        """Of light from above and from below what is spread, (2, t, p); arguments as of `sums`."""
        if scale is None or len(scale) < 6:
            return np.zeros((2, len(theta), len(phi)), np.float32)
        g = [
            self.at(one, side, theta[:, None], phi, wavelength)
            for side, one in enumerate(scale[4:])
        ]
        return np.stack(g) * np.float32(sum(gathered(scale[4:], self._medium, wavelength)))

    def at(
        self,
        table: DirectionalTable,
        side: int,
        theta: ArrayLike,
        phi: ArrayLike,
        wavelength: float,
    ) -> Array:
        """One of `scale` at directions on its side: angles (rad) of any one shape."""
        return _value(table, self._medium, side, theta, phi, wavelength)

    def transport(
        self,
        theta: Sequence[Real],
        phi: Real,
        wavelength: float,
        weighted: DirectionalTable | None = None,
    ) -> BothSides:
        """From weights on the grids to R + T at polar angles of either side, and azimuths, rad.

        weighted : what has the weights, if on other directions than the grids'.
        """
        k = float(wavenumber(wavelength))
        grids = self._grids if weighted is None else self._grids_of(weighted, wavelength)
        parts: list[list[tuple[int, Transport]]] = [[], []]
        for link in self._links:
            orders = self._flat if link.flat else self._orders
            grid = grids[link.left]

            def of(at: Real, phi: Real, link: Link = link, orders: Orders = orders) -> list[Row]:
                tables = link.tables(
                    self._parts_of(link, at), at, k, self._table, self._height_scale
                )
                return [
                    _Linked(link, orders, k, float(angle), phi, table)
                    for angle, table in zip(at, tables, strict=True)
                ]

            found = orders.of_rows(of, theta[link.came], phi, grid)
            parts[link.came].append((link.left, found))
        return BothSides(parts)

    def _grids_of(
        self, scale: DirectionalTable, wavelength: float
    ) -> Sequence[SideGrid | GratingGrid]:
        if scale.grating is None:
            return self._sides_of((scale.values.shape[1] - 1, scale.values.shape[2]))
        rows = (self._units(scale.grating) + 1) * scale.grating.nodes
        return [GratingGrid(scale.grating, rows, wavelength)] * 2

    def _parts_of(self, link: Link, theta: Real) -> Real:
        """Those of a link, the same at all wavelengths."""
        key = link, theta.tobytes()
        if key not in self._parts:
            self._parts[key] = link.parts(theta)
        return self._parts[key]


def gathered(
    tables: Sequence[DirectionalTable], medium: Medium, wavelength: float
) -> tuple[float, float]:
    """∫ g n² cosθ dω of both sides' g, at a wavelength (nm)."""
    polar, azimuthal = NODES_OF_INTEGRALS
    theta = (np.arange(polar) + 0.5) * (0.5 * np.pi / polar)
    phi = (np.arange(azimuthal) + 0.5) * (2.0 * np.pi / azimuthal)
    weights = 0.5 * np.sin(2.0 * theta) * (0.5 * np.pi / polar) * (2.0 * np.pi / azimuthal)
    above, below = (
        medium.measured(side) ** 2
        * float(weights @ _value(table, medium, side, theta[:, None], phi, wavelength).sum(axis=1))
        for side, table in enumerate(tables)
    )
    return above, below


def _value(
    table: DirectionalTable,
    medium: Medium,
    side: int,
    theta: ArrayLike,
    phi: ArrayLike,
    wavelength: float,
) -> Array:
    if table.grating is not None:
        return table.at(theta, phi, wavelength)
    grid = SideGrid(table.grid.polar, table.grid.azimuthal, medium, side)
    return grid.interpolation(theta, phi)(table.page(wavelength))


class _Linked(Row):
    """Of light that goes along a link."""

    def __init__(
        self, link: Link, orders: Orders, k: float, theta: float, phi: Real, table: Real
    ) -> None:
        came, left = (link.medium.measured(side) for side in (link.came, link.left))
        sine = came * np.sin(theta) / left
        super().__init__(orders, k * left, sine, float(np.arcsin(min(sine, 1.0))), phi)
        self.sign = link.sign
        self._link, self._table, self._cos = link, table, float(np.cos(theta))
        self._per_w = k / link.medium.index

    def kappa(self, cos_o: Real) -> Real:
        """κ of the mixture, whose heights are larger by the index."""
        found = self._per_w * self._link.width(self._cos, cos_o)
        # powers over κ² have a limit, which their first step tells
        return np.maximum(found, self.mixture.kappa_step)

    def gain(self, cos_o: Real, turn: Real) -> Real:
        w = self.kappa(cos_o) / self._per_w
        return self._link.gain(partial(bilinear, self._table), w, self._cos, cos_o, turn)


def _places(grating: Grating, share: Real | float) -> tuple[Real, Real]:
    """ξ₁ and ξ₂ above whole numbers, (nodes, nodes): a share of the way beyond each two nodes."""
    place, nodes = np.arange(grating.nodes), (grating.nodes, grating.last)
    first, second = np.broadcast_arrays(place[:, None] + share, place + share)
    return fractions(first, *nodes), fractions(second, *nodes)


def _amid(grating: Grating, wavelength: float, last: int) -> Real:
    """Half of the way beyond nodes, or less if directions there are beyond the hemisphere."""
    share = np.full((grating.nodes, grating.nodes), 0.5)
    for earlier in EARLIER:
        width = last + sum(_places(grating, earlier))
        inside = width * grating.spacing <= 2.0 * float(wavenumber(wavelength))
        share = np.where(inside, earlier, share)
    return share


def _level(mixture: OrderMixture) -> OrderMixture:
    """That of no heights."""
    return replace(
        mixture,
        frequency=mixture.frequency[:0],
        powers=mixture.powers[:, :0],
        central=np.ones_like(mixture.central),
    )
