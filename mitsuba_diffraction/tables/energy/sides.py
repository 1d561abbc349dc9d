"""R + T of a dielectric surface, and scales of directions on both sides that make it 1.

A lossless dielectric sends all light on. What first order gains or lacks is order 0's: orders are
right to second order in the heights, and order 0, ∝ |a_0|² alone, is not. So c is sought on the
directions of both sides such that with f = f_0 + f_orders

    f'(ωi, ωo) = f_orders + f_0 c(ωi) c(ωo)   sends on   R + T near 1,

as in `conservation`, but upwards too. A sheet loses what is beyond its critical angle; that is put
back likewise. Where order 0 is too weak, as of rough surfaces, all of f' is scaled by s(ωi) s(ωo)
besides, evenly in proportion to what there is. Sums as in `transport`, over the links of a side
with a side.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from ...optics.geometry import wavenumber
from ..sampling.order_mixture import OrderMixture
from ..table import DiffractionTable
from .conservation import DirectionalTable, parallel, scaled
from .grid import DirectionGrid, Interpolation
from .links import Link, Medium
from .transport import Orders, Row, Transport

Real = NDArray[np.float64]
Array = NDArray[np.float32]

#: Directions of s on either side, and wavelengths; in variants of one wavelength there is one.
GRID, WAVELENGTHS = DirectionGrid(48, 48), 6
#: Light that goes to and fro beyond the critical angle takes more of them than reflection does.
SWEEPS = 30
#: R + T is left as it is between these, and brought between them elsewhere; it is left altogether
#: if it is nowhere above the last.
LEAST, MOST, TOLERATED = 0.99, 0.999, 1.001
#: Least that order 0 must leave for s not to be needed; by how much order 0 may change; and below
#: what share it is not changed.
ENOUGH, STRONGEST, FAINT = 0.98, 2.0, 1e-4
#: Beyond this angle (rad) ever less is brought back, by so much a radian: part of a lobe is below
#: the horizon.
CERTAIN, FALL = np.radians(75.5), 1.0
#: Where it differs between neighbours, this share of that is kept free below `MOST`, at most so
#: much: for what lies between them.
BETWEEN, MARGIN = 0.25, 0.006


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
class BothSides:
    """From weights (2, polar + 1, azimuthal) of directions to R + T (2, t, p).

    Attributes
    ----------
    parts : of either side, what goes to which side.
    """

    parts: list[list[tuple[int, Transport]]]

    def __call__(self, s: Array) -> Array:
        return self._sums(lambda link, weights: link(weights), s)

    def zeroth(self, s: Array) -> Array:
        """Order 0 alone."""
        return self._sums(lambda link, weights: link.glossy * link.mirror(weights), s)

    def _sums(self, of_link: Callable[[Transport, Array], Array | Real], s: Array) -> Array:
        sums = [sum(of_link(link, s[left]) for left, link in side) for side in self.parts]
        return np.asarray(np.stack(sums), np.float32)

    def changed(self, c: Array, here: Array) -> Callable[[Array], Array]:
        """R + T from weights, with order 0 scaled by c on the grids and at the directions."""
        return lambda s: self(s) - self.zeroth(s) + here * self.zeroth(c * s)


class Sides:
    """A table's surface at one height scale, of one dielectric; side 0 is above, 1 below."""

    def __init__(self, table: DiffractionTable, height_scale: float, medium: Medium) -> None:
        self._table, self._height_scale, self._medium = table, height_scale, medium
        # κ of light that stays within is larger by the index
        self._orders = Orders(table, height_scale * medium.index)
        self._flat = copy.copy(self._orders)
        self._flat.mixture, self._flat.has_weak = _level(self._orders.mixture), False
        self._links = medium.links()
        self._grids = [SideGrid(GRID.polar, GRID.azimuthal, medium, side) for side in (0, 1)]
        self._ones = np.ones((2, GRID.polar + 1, GRID.azimuthal), np.float32)
        self._parts: dict[tuple[Link, bytes], Real] = {}

    def scale(self, wavelength_range: tuple[float, float]) -> list[DirectionalTable] | None:
        """c above and below, then s if any is needed; None where R + T is near 1 as it is.

        A second or two. Their polar angles are `Medium.angle`.
        """
        low, high = wavelength_range
        wavelengths = np.geomspace(low, high, WAVELENGTHS if high > low else 1)
        found = np.stack(parallel(self._scale_at, wavelengths.tolist()), axis=1)
        if np.all(found == 1.0):
            return None
        needed = found if np.any(found[2:] != 1.0) else found[:2]
        return [DirectionalTable(wavelengths, values) for values in needed]

    def _scale_at(self, wavelength: float) -> Array:
        """(4, polar + 1, azimuthal)."""
        theta = [grid.angles for grid in self._grids]
        transport = self.transport(theta, GRID.phi, wavelength)
        sums, angle = transport(self._ones), np.stack(theta)[..., None]
        c, s = self._ones, self._ones
        if not _near_1(sums, angle, LEAST):
            zeroth = transport.zeroth(self._ones)
            wanted = _aims(sums, angle) - (sums - zeroth)
            wanted = np.clip(wanted, zeroth / STRONGEST, zeroth * STRONGEST)
            c = scaled(transport.zeroth, wanted, angle, SWEEPS)
            c = np.where(zeroth > FAINT, c, np.float32(1.0))
            changed = transport.changed(c, c)
            sums = changed(self._ones)
            if not _near_1(sums, angle, ENOUGH):
                aim = _aims(sums, angle)
                s = scaled(changed, aim, angle, SWEEPS)
                # Where there is no such scale, light is lost rather than gained
                s = s * np.minimum(1.0, aim / np.maximum(s * changed(s), 1e-6))
        return np.concatenate([c, s])

    def sums(
        self, scale: Sequence[DirectionalTable] | None, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Array, Array]:
        """R + T as it is and scaled, (2, t, p) each, of light from above and from below.

        Exact sums at these angles (rad), not the grid's; nm.
        """
        transport = self.transport([theta, theta], phi, wavelength)
        raw = transport(self._ones)
        if scale is None:
            return raw, raw
        pages = [one.page(wavelength) for one in scale]
        here = [
            self._grids[n % 2].interpolation(theta[:, None], phi)(page)
            for n, page in enumerate(pages)
        ]
        changed = transport.changed(np.stack(pages[:2]), np.stack(here[:2]))
        if len(pages) == 2:
            return raw, changed(self._ones)
        return raw, np.stack(here[2:]) * changed(np.stack(pages[2:]))

    def at(
        self,
        table: DirectionalTable,
        side: int,
        theta: ArrayLike,
        phi: ArrayLike,
        wavelength: float,
    ) -> Array:
        """One of `scale` at directions on its side: angles (rad) of any one shape."""
        return self._grids[side].interpolation(theta, phi)(table.page(wavelength))

    def transport(self, theta: Sequence[Real], phi: Real, wavelength: float) -> BothSides:
        """From weights on the grids to R + T at polar angles of either side, and azimuths, rad."""
        k = float(wavenumber(wavelength))
        parts: list[list[tuple[int, Transport]]] = [[], []]
        for link in self._links:
            orders, grid = self._flat if link.flat else self._orders, self._grids[link.left]

            def rows(at: Real, phi: Real, link: Link = link, orders: Orders = orders) -> list[Row]:
                tables = link.tables(
                    self._parts_of(link, at), at, k, self._table, self._height_scale
                )
                return [
                    _Linked(link, orders, k, float(angle), phi, table)
                    for angle, table in zip(at, tables, strict=True)
                ]

            found = orders.of_rows(rows, theta[link.came], phi, grid)
            parts[link.came].append((link.left, found))
        return BothSides(parts)

    def _parts_of(self, link: Link, theta: Real) -> Real:
        """Those of a link, the same at all wavelengths."""
        key = link, theta.tobytes()
        if key not in self._parts:
            self._parts[key] = link.parts(theta)
        return self._parts[key]


class _Linked(Row):
    """Of light that goes along a link."""

    def __init__(
        self, link: Link, orders: Orders, k: float, theta: float, phi: Real, table: Real
    ) -> None:
        came, left = (link.medium.measured(side) for side in (link.came, link.left))
        sine = came * np.sin(theta) / left
        super().__init__(orders, k * left, sine, float(np.arcsin(min(sine, 1.0))), phi)
        self._link, self._table, self._cos = link, table, float(np.cos(theta))
        self._per_w = k / link.medium.index

    def kappa(self, cos_o: Real) -> Real:
        """κ of the mixture, whose heights are larger by the index."""
        found = self._per_w * self._link.width(self._cos, cos_o)
        # powers over κ² have a limit, which their first step tells
        return np.maximum(found, self.mixture.kappa_step)

    def gain(self, cos_o: Real, turn: Real) -> Real:
        w = self.kappa(cos_o) / self._per_w
        return self._link.gain(self._table, w, self._cos, cos_o, turn)


def _near_1(sums: Array, angle: Real, least: float) -> bool:
    return bool(np.all((sums >= least) & (sums <= TOLERATED) | (angle > CERTAIN)))


def _aims(sums: Array, angle: Real) -> Array:
    """What R + T is to be."""
    most = MOST - np.minimum(BETWEEN * _variation(sums), MARGIN)
    least = LEAST - FALL * np.maximum(angle - CERTAIN, 0.0)
    return np.asarray(np.clip(sums, least.astype(np.float32), most), np.float32)


def _variation(sums: Array) -> Array:
    """Largest less least of a direction and those around it."""
    around = {"size": (1, 3, 3), "mode": ["nearest", "nearest", "wrap"]}
    return np.asarray(maximum_filter(sums, **around) - minimum_filter(sums, **around))


def _level(mixture: OrderMixture) -> OrderMixture:
    """That of no heights."""
    return replace(
        mixture,
        frequency=mixture.frequency[:0],
        powers=mixture.powers[:, :0],
        central=np.ones_like(mixture.central),
    )
