"""R + T of a dielectric surface or a thin sheet, and the scale that brings it to 1 (NumPy only).

A lossless dielectric sends all light on. What first order gains or lacks is order 0's: orders are
right to second order in the heights, and order 0, ∝ |a_0|² alone, is not. So c is sought on the
directions of both sides such that with f = f_0 + f_orders

    f'(ωi, ωo) = f_orders + f_0 c(ωi) c(ωo)   sends on   R + T = 1,

by the iteration of `scaling`, on both sides stacked. A sheet loses the light beyond its critical
angle; c puts that back likewise. Where order 0 has too little light to make up for what is missing,
that stays missing. Where the other orders of a steep surface exceed 1 on their own, all light is
attenuated by t(ωi) t(ωo), t at most 1.

Side 0 is above the structure, 1 below: within the dielectric, or outside of the flat other side of
a sheet. In what goes through, w = |qi − qo|, q at the structure.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import median_filter

from ...optics import boundary, coat, fresnel, through
from ...optics.boundary import Complex
from ..table import DiffractionTable
from .conservation import between, wavelengths_of
from .gain import Boundary, Gain
from .grid import Array, DirectionalTable, DirectionGrid, Real
from .scaling import lowered, parallel, scaled
from .settings import EnergySettings, energy_settings
from .transport import Mirrored, Orders, Way

#: Where order 0 has less of the light, it is not changed.
FAINT = 1e-4
_DOWN = np.array([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Medium:
    """The dielectric.

    Attributes
    ----------
    index : over that of the medium above.
    model : one of `optics.through.MODELS`.
    thin : whether below is beyond the flat side of a sheet.
    """

    index: float
    model: str
    thin: bool

    def ways(self, least: float) -> list[tuple[int, int, Boundary]]:
        """Sides that light comes from and goes to, and by which boundary; least : of w."""
        n, model = self.index, boundary.checked_model(self.model, through.MODELS)
        inside = 1.0 if self.thin else n
        ways: list[tuple[int, int, Boundary]] = [
            (0, 0, Boundary(n, model)),
            (0, 1, Passed(n, model, 1.0, inside, -1, least, thin=self.thin)),
            (1, 0, Passed(n, model, inside, 1.0, -1, least, down=False, thin=self.thin)),
        ]
        if not self.thin:
            return [*ways, (1, 1, Boundary(1.0 / n, model, n, n, -1))]
        beneath = (1, 1, Beneath(n, model, sign=-1)), (1, 1, Face(n, "kirchhoff"))
        return [*ways, *beneath, (0, 0, Returned(None, model, sheet=n))]


@dataclass(frozen=True)
class Dielectric(Boundary):
    """Boundary of a real index."""

    @property
    def real(self) -> float:
        """The index."""
        assert isinstance(self.index, (int, float))
        return float(self.index)


@dataclass(frozen=True)
class Passed(Dielectric):
    """Light that goes through, down or up; through a sheet, out of its flat side as well."""

    down: bool = True
    thin: bool = False

    def normals(self, cos_i: Real, cos_o: Real) -> tuple[Real, Real]:
        if self.thin:
            n = self.real
            return (cos_i, _deeper(cos_o, n)) if self.down else (_deeper(cos_i, n), cos_o)
        return super().normals(cos_i, cos_o)

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        q_i, q_o = self.normals(cos_i, cos_o)
        return np.abs(q_i - q_o)

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        q_i, q_o = self.normals(cos_i, cos_o)
        return np.asarray(1.0 / (q_i * q_o * np.maximum(np.abs(q_i - q_o), self.least) ** 2))

    def matrices(self, wi: Real, wo: Real) -> tuple[Complex, Complex]:
        n = self.real
        above, below = (wi, wo * _DOWN) if self.down else (wo, wi * _DOWN)
        inside = coat.refracted(below * _DOWN, n) * _DOWN if self.thin else below
        first, second = through.kirchhoff(above, inside, n), through.small_slope(above, inside, n)
        if not self.thin:
            return first, second
        leave = through.out_of_sheet
        return leave(first, above, below, n), leave(second, above, below, n)

    def order_0(self, gain: Gain, cos_i: Real, cos_o: Real) -> Real:
        ends = zip((cos_i, cos_o), (0, 1) if self.down else (1, 0), strict=True)
        shares = [
            through.flat_transmittances(np.atleast_1d(cosine), self.real, self.thin, side)
            for cosine, side in ends
        ]
        return np.asarray(np.mean(np.sqrt(shares[0] * shares[1]), axis=0))


class Beneath(Dielectric):
    """Light from below a sheet that the structure sends back, through its flat side."""

    def normals(self, cos_i: Real, cos_o: Real) -> tuple[Real, Real]:
        return _deeper(cos_i, self.real), _deeper(cos_o, self.real)

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        q_i, q_o = self.normals(cos_i, cos_o)
        return np.asarray(1.0 / (q_i * q_o * (q_i + q_o) ** 2))

    def matrices(self, wi: Real, wo: Real) -> tuple[Complex, Complex]:
        n = self.real
        inside = coat.refracted(wi, n), coat.refracted(wo, n)
        first, second = (
            coat.transmitted(model(*inside, 1.0 / n), wi, wo, n, 1.0 / n)
            for model in (boundary.kirchhoff, boundary.small_slope)
        )
        return first, second


class Face(Boundary):
    """Light from below that the flat side of a sheet reflects."""

    flat = True


@dataclass(frozen=True)
class Returned(Boundary):
    """Light from above that the flat side of a sheet sends back through the structure."""

    sheet: float = 1.0

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        return np.hypot(*(_deeper(cosine, self.sheet) - cosine for cosine in (cos_i, cos_o)))

    def common(self, cos_i: Real, cos_o: Real, cos_turn: Real | float) -> Real:
        shares = []
        for cosine in (cos_i, cos_o):  # T² R / (1 − R²), the mean of both polarisations
            back = np.abs(np.stack(fresnel.amplitudes(cosine, self.sheet))) ** 2
            shares.append(np.mean((1.0 - back) * back / (1.0 + back), axis=0))
        return np.sqrt(shares[0] * shares[1]) + 0.0 * np.asarray(cos_turn)


def _deeper(cosine: Real, index: float) -> Real:
    """q in a sheet of light at an angle outside."""
    return np.sqrt(index**2 - 1.0 + cosine**2)


@dataclass(frozen=True)
class SideSums:
    """R + T of light from both sides, (2, t, p): of the orders, and of order 0 for weights.

    Attributes
    ----------
    orders : sums of all orders but order 0.
    mirrored : for each way, the sides that light comes from and goes to, and its share.
    """

    orders: Array
    mirrored: list[tuple[int, int, Mirrored]]

    def zeroth(self, c: Array) -> Array:
        """Sums of order 0 alone, from weights on the grid."""
        sums = np.zeros(self.orders.shape)
        for came, left, share in self.mirrored:
            sums[came] += share(c[left])
        return sums.astype(np.float32)


@dataclass(frozen=True)
class Middles:
    """R + T in the middles of the grid's cells, for scales (2, polar + 1, azimuthal) at its nodes.

    Attributes
    ----------
    sums : R + T there.
    here : interpolation of a scale to the middles.
    """

    sums: SideSums
    here: Callable[[Array], Array]
    settings: EnergySettings

    def order_0(self, c: Array) -> Array:
        """Sums of order 0 scaled by c."""
        return np.stack([self.here(side) for side in c]) * self.sums.zeroth(c)

    def order_0_excess(self, c: Array) -> Array:
        """Factor by which order 0 is too large, for `lowered`."""
        room = np.maximum(np.float32(self.settings.ceiling) - self.sums.orders, 1e-6)
        zeroth = self.order_0(c)
        factor = np.clip(zeroth / room, 1.0, self.settings.largest**2)
        return np.where(zeroth > FAINT, factor, 1.0).astype(np.float32)

    def total(self, c: Array) -> Array:
        """R + T with order 0 scaled by c."""
        return self.sums.orders + self.order_0(c)

    def excess(self, total: Array, t: Array) -> Array:
        """Factor by which R + T, attenuated by t, is too large, for `lowered`.

        Light sent on is attenuated by t as well, which is at most 1: the bound t(ωi) (R + T).
        """
        attenuated = np.stack([self.here(side) for side in t]) * total
        return np.maximum(attenuated / np.float32(self.settings.ceiling), 1.0)


class Sides:
    """A table's surface at one height scale, of one dielectric."""

    def __init__(self, table: DiffractionTable, height_scale: float, medium: Medium) -> None:
        self._settings, self._height_scale = energy_settings(), height_scale
        # κ of light that stays within is larger by the index
        heights = height_scale * medium.index
        self._orders = Orders(table, heights, self._settings, apart=True)
        least = self._orders.mixture.kappa_step * medium.index
        least /= 2.0 * np.pi * 1e3 / table.wavelength_range[1]
        self._ways = medium.ways(least)
        self._grid = DirectionGrid(self._settings.side_polar, self._settings.azimuthal)

    def scale(self, wavelength_range: tuple[float, float]) -> list[DirectionalTable] | None:
        """Find c above and below, then t if any is less than 1; None where R + T is 1 as it is."""
        grid, settings = self._grid, self._settings
        wavelengths = wavelengths_of(wavelength_range, settings.side_wavelengths)
        ones = np.stack([grid.ones] * 2)

        def solved(wavelength: float) -> Array:
            sums = self._sums(grid.theta, grid.phi, wavelength)
            zeroth, most = sums.zeroth(ones), settings.largest**2
            if np.abs(sums.orders + zeroth - 1.0).max() < settings.close:
                return ones
            wanted = np.clip(1.0 - sums.orders, zeroth / most, zeroth * most)
            c = scaled(sums.zeroth, wanted, settings.largest, settings.sweeps)
            c = np.where(zeroth > FAINT, c, np.float32(1.0))
            # what lies within one row, as a lobe at the critical angle, is left to itself
            return np.asarray(median_filter(c, (1, 3, 1), mode="nearest"))

        c = np.stack(parallel(solved, wavelengths.tolist()))
        if np.all(c == 1.0):
            return None
        middles = parallel(self._middles, between(wavelengths).tolist())
        c = lowered(c, [cells.order_0_excess for cells in middles], settings)
        scales = [DirectionalTable(wavelengths, c[:, side]) for side in (0, 1)]
        totals = [
            cells.total(0.5 * (c[n] + c[min(n + 1, len(c) - 1)])) for n, cells in enumerate(middles)
        ]
        if max(total.max() for total in totals) > settings.tolerated:
            excess = [
                partial(cells.excess, total) for cells, total in zip(middles, totals, strict=True)
            ]
            t = lowered(np.ones_like(c), excess, settings)
            scales += [DirectionalTable(wavelengths, t[:, side]) for side in (0, 1)]
        return scales

    def _middles(self, wavelength: float) -> Middles:
        theta, phi = self._grid.middles(1)
        here = self._grid.interpolation(theta[:, None], phi)
        return Middles(self._sums(theta, phi, wavelength), here, self._settings)

    def sums(
        self, scale: Sequence[DirectionalTable] | None, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Array, Array]:
        """R + T as it is and scaled, (2, t, p) each, of light from above and from below.

        Exact sums at these angles (rad), not the grid's; nm. Where light is attenuated they are
        bounds: t(ωo) counts as 1.
        """
        sums = self._sums(theta, phi, wavelength)
        raw = sums.orders + sums.zeroth(np.stack([self._grid.ones] * 2))
        if scale is None:
            return raw, raw
        here = np.stack([side.at(theta[:, None], phi, wavelength) for side in scale])
        pages = np.stack([side.page(wavelength) for side in scale])
        total = sums.orders + here[:2] * sums.zeroth(pages[:2])
        return raw, total * here[2:] if len(scale) > 2 else total

    def _sums(self, theta: Real, phi: Real, wavelength: float) -> SideSums:
        grid, half, surface = self._grid, self._grid.half, self._orders
        orders, mirrored = np.zeros((2, len(theta), len(phi))), []
        for came, left, way in self._ways:
            gain = surface.gain(wavelength, way, self._height_scale)
            rays = [Way(surface, gain, angle) for angle in theta.tolist()]
            shares = [ray.mirrored(grid) for ray in rays]
            mirrored.append((came, left, Mirrored.of(shares, phi, grid)))
            if surface.has_weak and not way.flat:
                coarse = [Way(surface, gain, angle) for angle in half.theta.tolist()]
                weak = np.stack([ray.weak(half.phi).sum(axis=-1) for ray in coarse])
                orders[came] += half.interpolation(theta[:, None], phi)(weak)
            if surface.has_strong and not way.flat:
                orders[came] += [ray.strong(phi)[0].sum(axis=-1) for ray in rays]
        return SideSums(orders.astype(np.float32), mirrored)
