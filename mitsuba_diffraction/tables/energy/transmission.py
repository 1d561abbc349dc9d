"""R + T of a dielectric surface or a thin sheet, and the scale that brings it to 1 (NumPy only).

A lossless dielectric sends all light on. What first order gains or lacks is order 0's: orders are
right to second order in the heights, and order 0, ∝ |a_0|² alone, is not. So c is sought on the
directions of both sides such that with f = f_0 + f_orders

    f'(ωi, ωo) = f_orders + f_0 c(ωi) c(ωo)   sends on   R + T = 1,

by the iteration of `scaling`, on both sides stacked. A sheet loses the light beyond its critical
angle; c puts that back likewise, as far as order 0 has light.

Side 0 is above the structure, 1 below: within the dielectric, or outside of the flat other side of
a sheet. With m the index of the medium that a side's directions are measured in, n that at the
structure and q = n cosθ there, an order takes light from mi sinθi to mo sinθo with the share

    η = G |a_j|²,   G = 4 qi qo N / w²,   w = qi + qo, or |qi − qo| where it goes through,

at κ = k w: N, mean power of Jones matrices, as in `optics.boundary` and `optics.through`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import median_filter

from ...optics import blend, boundary, coat, fresnel, through
from ...optics.blend import RoughnessTable
from ...optics.geometry import wavenumber
from ..table import DiffractionTable
from .conservation import between, wavelengths_of
from .gain import LEAST_COSINE, read
from .grid import Array, DirectionalTable, DirectionGrid, Real
from .scaling import lowered, parallel, scaled
from .settings import energy_settings
from .transport import Mirrored, Orders, Way

#: Polar angles and cosines of azimuths of tables of N.
POLAR, AZIMUTHS = 91, 33
#: The plugin looks up tangential parts up to this, in units of k.
FARTHEST = 2.0
#: Where order 0 has less of the light, it is not changed.
FAINT = 1e-4
_DOWN = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Medium:
    """The dielectric.

    Attributes
    ----------
    index : over that of the medium above.
    model : "kirchhoff" or "small_slope".
    thin : whether below is beyond the flat side of a sheet.
    """

    index: float
    model: str
    thin: bool

    def measured(self, side: int) -> float:
        """m of a side."""
        return 1.0 if self.thin or side == 0 else self.index

    def normal(self, side: int, cosine: Real) -> Real:
        """q of directions, by their cosines where they are measured."""
        if side == 0:
            return cosine
        if self.thin:
            return np.sqrt(self.index**2 - 1.0 + cosine**2)
        return self.index * cosine

    def links(self) -> list[Link]:
        """All ways from a side to a side."""
        every = [Link(self, came, left) for came in (0, 1) for left in (0, 1)]
        return [*every, Face(self, 1, 1), Returned(self, 0, 0)] if self.thin else every


@dataclass(frozen=True)
class Link:
    """Light that goes from one side to the same or the other."""

    medium: Medium
    came: int
    left: int

    #: Whether the orders are those of a flat surface.
    flat = False

    @property
    def sign(self) -> int:
        """Sign of the orders' frequencies: from within, heights are turned over; through, κ is."""
        return 1 if self.came == self.left == 0 else -1

    def width(self, cos_i: float, cos_o: Real) -> Real:
        """w."""
        q_i, q_o = self._normals(cos_i, cos_o)
        return np.asarray(q_i + q_o if self.came == self.left else np.abs(q_i - q_o))

    def gain(self, table: Real, least: float, cos_i: float, cos_o: Real, turn: Real) -> Real:
        """G, from θi's table of 4 qi² qo² N.

        least : of w; powers over w² have a limit for w → 0.
        """
        q_i, q_o = self._normals(cos_i, cos_o)
        w = np.maximum(self.width(cos_i, cos_o), least)
        reached = self._squared(cos_i, cos_o, np.cos(turn)) < FARTHEST**2
        return read(table, cos_o, turn) / (q_i * q_o * w**2) * reached

    def gain_0(self, k: float, roughness: RoughnessTable, scale: float) -> Callable[..., Real]:
        """G of order 0 as a function of cosθi, cosθo and φo − φi = π."""

        def reflected(cos_i: float, cos_o: Real, turn: Real) -> Real:
            ends = np.asarray(cos_i), cos_o, np.cos(turn)
            q_i, q_o = self._normals(cos_i, cos_o)
            found = self.blended(self.powers(*ends), *ends, k, roughness, scale)
            return found / (q_i * q_o * (q_i + q_o) ** 2)

        def passed(cos_i: float, cos_o: Real, turn: Real) -> Real:
            n, thin = self.medium.index, self.medium.thin
            shares = [
                through.flat_transmittances(np.atleast_1d(cosine), n, thin, side)
                for side, cosine in ((self.came, cos_i), (self.left, cos_o))
            ]
            return np.asarray(np.mean(np.sqrt(shares[0] * shares[1]), axis=0))

        return reflected if self.came == self.left else passed

    def tables(self, powers: Real, theta: Real, k: float, orders: Orders) -> Real:
        """4 qi² qo² N at angles θi (rad), even angles θo and cosines of azimuths, at k."""
        scale = orders.height_scale / self.medium.index
        return self.blended(powers, *self.nodes(theta), k, orders.roughness, scale)

    def blended(
        self,
        powers: Real,
        cos_i: Real,
        cos_o: Real,
        cos_turn: Real,
        k: float,
        roughness: RoughnessTable,
        scale: float,
    ) -> Real:
        """4 qi² qo² N of the medium's model, from those of `powers`."""
        if self.medium.model == "kirchhoff":
            return np.asarray(powers[1])
        tangential = k * np.sqrt(self._squared(cos_i, cos_o, cos_turn))
        kappa = k * scale * self.width(cos_i, cos_o)
        s = blend.weight(kappa, roughness.at(tangential), self.medium.index)
        return np.asarray(
            s * s * powers[0] + (1.0 - s) ** 2 * powers[1] + 2.0 * s * (1.0 - s) * powers[2]
        )

    def powers(self, cos_i: Real, cos_o: Real, cos_turn: Real) -> Real:
        """4 qi² qo² times the powers of both models' matrices and of their product, (3, …)."""
        cos_i, cos_o = (np.clip(cosine, LEAST_COSINE, 1.0) for cosine in (cos_i, cos_o))
        sin_i, sin_o = np.sqrt(1.0 - cos_i**2), np.sqrt(1.0 - cos_o**2)
        across = np.sqrt(1.0 - cos_turn**2)
        first = [sin_i, 0.0, cos_i], [sin_o * cos_turn, sin_o * across, cos_o]
        wi, wo = (np.stack(np.broadcast_arrays(*parts, cos_o)[:3], axis=-1) for parts in first)
        wi, wo = np.broadcast_arrays(wi, wo)
        gentle, tangent = self._matrices(wi, wo)
        q_i, q_o = self._normals(cos_i, cos_o)
        mixed = 0.5 * np.sum((gentle * tangent.conj()).real, axis=(-2, -1))
        each = [boundary.unpolarised(gentle), boundary.unpolarised(tangent), mixed]
        return np.asarray(4.0 * (q_i * q_o) ** 2 * np.stack(each))

    def nodes(self, theta: Real) -> tuple[Real, Real, Real]:
        """Cosines of θi, θo and φo − φi of tables."""
        cos_o = np.cos(np.linspace(0.0, 0.5 * np.pi, POLAR))
        return np.cos(theta)[:, None, None], cos_o[:, None], np.linspace(-1.0, 1.0, AZIMUTHS)

    def _matrices(self, wi: Real, wo: Real) -> list[boundary.Complex]:
        """B and K of directions that are both as if above."""
        n, thin = self.medium.index, self.medium.thin
        if self.came != self.left:
            above, below = (wi, wo * _DOWN) if self.came == 0 else (wo, wi * _DOWN)
            inside = coat.refracted(below * _DOWN, n) * _DOWN if thin else below
            pair = [f(above, inside, n) for f in (through.small_slope, through.kirchhoff)]
            return [through.out_of_sheet(one, above, below, n) for one in pair] if thin else pair
        reflect = boundary.small_slope, boundary.kirchhoff
        if self.came == 0:
            return [f(wi, wo, n) for f in reflect]
        if not thin:
            return [f(wi, wo, 1.0 / n) for f in reflect]
        inside, left = coat.refracted(wi, n), coat.refracted(wo, n)
        pair = [f(inside, left, 1.0 / n) for f in reflect]
        return [coat.transmitted(one, wi, wo, n, 1.0 / n) for one in pair]

    def _normals(self, cos_i: Real | float, cos_o: Real) -> tuple[Real, Real]:
        medium = self.medium
        return medium.normal(self.came, np.asarray(cos_i)), medium.normal(self.left, cos_o)

    def _squared(self, cos_i: Real | float, cos_o: Real, cos_turn: Real) -> Real:
        """Squared tangential part of the sum of directions, in units of k."""
        m_i, m_o = (self.medium.measured(side) for side in (self.came, self.left))
        incident, outgoing = m_i**2 * (1.0 - cos_i**2), m_o**2 * (1.0 - cos_o**2)
        total = incident + outgoing + 2.0 * np.sqrt(incident * outgoing) * cos_turn
        return np.maximum(total, 0.0)


class Face(Link):
    """Light that the flat side of a sheet reflects, from outside."""

    flat = True

    def _matrices(self, wi: Real, wo: Real) -> list[boundary.Complex]:
        return [boundary.kirchhoff(wi, wo, self.medium.index)] * 2

    def _normals(self, cos_i: Real | float, cos_o: Real) -> tuple[Real, Real]:
        return np.asarray(cos_i), cos_o


class Returned(Link):
    """Light that the flat side of a sheet sends back through the structure."""

    def width(self, cos_i: float, cos_o: Real) -> Real:
        n = self.medium.index
        deeper = [np.sqrt(n * n - 1.0 + cosine**2) - cosine for cosine in (cos_i, cos_o)]
        return np.hypot(*deeper)

    def gain(self, table: Real, least: float, cos_i: float, cos_o: Real, turn: Real) -> Real:
        reached = self._squared(cos_i, cos_o, np.cos(turn)) < FARTHEST**2
        return np.sqrt(self._kept(np.asarray(cos_i)) * self._kept(cos_o)) * reached

    def gain_0(self, k: float, roughness: RoughnessTable, scale: float) -> Callable[..., Real]:
        return partial(self.gain, np.zeros(()), 0.0)

    def powers(self, cos_i: Real, cos_o: Real, cos_turn: Real) -> Real:
        return np.zeros((3, len(cos_i), 1, 1))  # it needs none

    def blended(self, powers: Real, *others: object) -> Real:
        return np.asarray(powers[0])

    def _kept(self, cosine: Real) -> Real:
        """T² R / (1 − R²), the mean of both polarisations."""
        back = np.abs(np.stack(fresnel.amplitudes(cosine, self.medium.index))) ** 2
        return np.asarray(np.mean((1.0 - back) * back / (1.0 + back), axis=0))


@dataclass(frozen=True)
class SideSums:
    """R + T of light from both sides, (2, t, p): of the orders, and of order 0 for weights.

    Attributes
    ----------
    orders : sums of all orders but order 0.
    mirrored : for each link, the sides that light comes from and goes to, and its share.
    """

    orders: Array
    mirrored: list[tuple[int, int, Mirrored]]

    def zeroth(self, c: Array) -> Array:
        """Sums of order 0 alone, from weights on the grid."""
        sums = np.zeros(self.orders.shape)
        for came, left, share in self.mirrored:
            sums[came] += share(c[left])
        return sums.astype(np.float32)


class Sides:
    """A table's surface at one height scale, of one dielectric; side 0 is above, 1 below."""

    def __init__(self, table: DiffractionTable, height_scale: float, medium: Medium) -> None:
        self.settings, self._medium = energy_settings(), medium
        # κ of light that stays within is larger by the index
        self._orders = Orders(table, height_scale * medium.index, self.settings, apart=True)
        self._level = self._orders.level()
        self._grid = DirectionGrid(self.settings.side_polar, self.settings.azimuthal)
        self._powers: dict[tuple[Link, bytes], Real] = {}

    def scale(self, wavelength_range: tuple[float, float]) -> list[DirectionalTable] | None:
        """Find c above and below; None where R + T is 1 as it is."""
        grid, settings = self._grid, self.settings
        wavelengths = wavelengths_of(wavelength_range, settings.side_wavelengths)
        ones = np.stack([grid.ones] * 2)

        def solved(wavelength: float) -> Array:
            sums = self._sums(grid.theta, grid.phi, wavelength)
            zeroth = sums.zeroth(ones)
            total = sums.orders + zeroth
            if np.abs(total - 1.0).max() < settings.close:
                return ones
            most = settings.largest**2
            wanted = np.clip(1.0 - sums.orders, zeroth / most, zeroth * most)
            c = scaled(sums.zeroth, wanted, settings.largest, settings.sweeps)
            c = np.where(zeroth > FAINT, c, np.float32(1.0))
            # what lies within one row, as a lobe at the critical angle, is left to itself
            return np.asarray(median_filter(c, (1, 3, 1), mode="nearest"))

        scale = np.stack(parallel(solved, wavelengths.tolist()))
        if np.all(scale == 1.0):
            return None
        scale = lowered(scale, parallel(self._excess, between(wavelengths).tolist()), settings)
        return [DirectionalTable(wavelengths, scale[:, side]) for side in (0, 1)]

    def _excess(self, wavelength: float) -> Callable[[Array], Array]:
        """Factor by which order 0 between nodes is too large, for `lowered`."""
        grid, most = self._grid, self.settings.largest**2
        ceiling = np.float32(self.settings.ceiling)
        theta, phi = grid.middles(1)
        sums = self._sums(theta, phi, wavelength)
        here = grid.interpolation(theta[:, None], phi)

        def of_page(c: Array) -> Array:
            zeroth = np.stack([here(side) for side in c]) * sums.zeroth(c)
            room = np.maximum(ceiling - sums.orders, 0.0)
            factor = np.clip(zeroth / np.maximum(room, 1e-6), 1.0, most)
            return np.where(zeroth > FAINT, factor, 1.0).astype(np.float32)

        return of_page

    def sums(
        self, scale: Sequence[DirectionalTable] | None, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Array, Array]:
        """R + T as it is and scaled, (2, t, p) each, of light from above and from below.

        Exact sums at these angles (rad), not the grid's; nm.
        """
        sums, ones = self._sums(theta, phi, wavelength), np.stack([self._grid.ones] * 2)
        raw = sums.orders + sums.zeroth(ones)
        if scale is None:
            return raw, raw
        here = np.stack([side.at(theta[:, None], phi, wavelength) for side in scale])
        pages = np.stack([side.page(wavelength) for side in scale])
        return raw, sums.orders + here * sums.zeroth(pages)

    def _sums(self, theta: Real, phi: Real, wavelength: float) -> SideSums:
        k, grid = float(wavenumber(wavelength)), self._grid
        half = DirectionGrid(min(grid.polar // 2, 24), min(grid.azimuthal // 2, 30))
        orders, mirrored = np.zeros((2, len(theta), len(phi))), []
        for link in self._medium.links():
            ways = self._ways(link, theta, k)
            shares = Mirrored.of([way.mirrored(grid) for way in ways], phi, grid)
            mirrored.append((link.came, link.left, shares))
            if link.flat:
                continue
            if self._orders.has_weak:
                weak = [way.weak(half.phi).sum(axis=-1) for way in self._ways(link, half.theta, k)]
                orders[link.came] += half.interpolation(theta[:, None], phi)(np.stack(weak))
            if len(self._orders.mixture.frequency):
                orders[link.came] += [way.strong(phi)[0].sum(axis=-1) for way in ways]
        return SideSums(orders.astype(np.float32), mirrored)

    def _ways(self, link: Link, theta: Real, k: float) -> list[Way]:
        """The way of light along a link, for each polar angle of incidence (rad)."""
        orders = self._level if link.flat else self._orders
        tables = np.zeros((len(theta), 2, 2))
        if orders.has_weak or len(orders.mixture.frequency):
            key = link, theta.tobytes()
            if key not in self._powers:  # the same at all wavelengths
                self._powers[key] = link.powers(*link.nodes(theta))
            tables = link.tables(self._powers[key], theta, k, orders)
        came, left = (self._medium.measured(side) for side in (link.came, link.left))
        per_w = k / self._medium.index  # heights of the orders are larger by the index
        least = orders.mixture.kappa_step / per_w
        gain_0 = link.gain_0(k, orders.roughness, orders.height_scale / self._medium.index)

        def way(angle: float, table: Real) -> Way:
            cosine = max(float(np.cos(angle)), LEAST_COSINE)
            return Way(
                orders,
                k * left,
                came * float(np.sin(angle)) / left,
                lambda cos_o: per_w * link.width(cosine, cos_o),
                partial(link.gain, table, least, cosine),
                partial(gain_0, cosine),
                link.sign,
            )

        return [way(angle, table) for angle, table in zip(theta.tolist(), tables, strict=True)]
