"""Lobes of solved orders under the coherence window, in a variant's own channels (Dr.Jit).

With q = k (u, v) of ωi + ωo, f cosθo = Σ_m η_m(ωi, λ) (k²σ²/π) exp(−σ²|q − q_m|²) cosθo: each
lobe's integral over directions is its order's efficiency, but for what lies beyond the horizon.
Order 0 is a mirror's lobe (`optics.mirror`): times C(X_i) C(X_o), it has all of its efficiency.
Orders are looked up by the functions of `lookup`, with the grid on the device.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ...optics.geometry import sigma_of
from ...optics.orders import lobe_peak, order_lobe
from ...plugin.arithmetic import maximum, minimum
from ...plugin.directions import Pair
from ...plugin.loops import sum_of
from ...plugin.memory import HalfFloats, index_between, once_a_table, read, upload
from ...plugin.sampling import BELOW_ONE
from ...plugin.types import (
    Colour,
    Context,
    Float,
    Index,
    Interaction,
    Mask,
    Spectrum,
    Vector2f,
)
from ..efficiency import lookup_in
from ..grid import OrderGrid
from ..lookup import Lookup, Order
from ..table import OrderTable

#: Mask of lanes whose ωo lies below a sheet; None without a sheet.
Below = Mask | None

#: Squared distance from a lobe's centre, in units of its width, beyond which it is 0.
REACH = 18.0
#: Sum of efficiencies below which nothing is drawn, against division by 0.
MIN_SUM = 1e-12


class Lit(NamedTuple):
    """Light of a pair of directions at one wavelength.

    Attributes
    ----------
    row : the incident light, placed in the look-up.
    value : f cosθo.
    peak : factor from efficiencies times lobes to f cosθo.
    terms : order, lobe, and efficiency of each lobe that reaches the pair.
    """

    row: Any
    value: Float
    peak: Float
    terms: list[tuple[Vector2f, Float, Float]]


class Draw(NamedTuple):
    """Tangential part of ωi + ωo in the patch's frame, drawn.

    below : whether ωo lies below a sheet.
    valid : whether there is any light.
    """

    uv: Vector2f
    below: Mask
    valid: Mask


class Device:
    """A grid in the current variant's memory; a `lookup.Memory`."""

    def __init__(self, grid: OrderGrid) -> None:
        arrays = {k: v for k, v in grid._asdict().items() if isinstance(v, np.ndarray)}
        self._starts = {k: upload(mi.UInt32, v) for k, v in arrays.items() if v.ndim == 1}
        # corners hold a record of 8 for each of their parts
        shapes = {k: v.reshape(-1, 8) if k == "corners" else v for k, v in arrays.items()}
        self._records = {k: HalfFloats(v) for k, v in shapes.items() if v.ndim == 2}

    def read(self, name: str, index: Index, numbers: int, active: Mask) -> Sequence[Float]:
        """See `Memory.read`."""
        records = self._records[name]
        # not on the weights: derivatives by them would be subnormal numbers
        packets = [packet * records.scale for packet in records.read(index, active)]
        return [mi.Float(x) for packet in packets for x in packet][:numbers]

    def start(self, name: str, kind: Index) -> Index:
        """See `Memory.start`."""
        return read(mi.UInt32, self._starts[name], kind)

    @staticmethod
    def sum(count: Index, add: Callable[..., Float], inputs: Any, zero: Float) -> Float:
        """See `Memory.sum`."""
        return sum_of(count, add, inputs, mi.Float(0.0))


@once_a_table
def order_lookup(table: OrderTable) -> Lookup:
    """Return the look-up of a table in the current variant."""
    elements = mi.is_polarized and table.polarised
    return lookup_in(table, Device, coated=True, elements=elements)


def draw(lookup: Lookup, row: Any, sample: Float) -> tuple[Order, Mask, Mask]:
    """Draw an order by its efficiency over `Lookup.total`.

    Returns (m_x, m_y), whether the order leaves on the second side, and whether there is any.
    """
    target, ports = sample * lookup.total(row), mi.UInt32(lookup.ports(row))

    def body(port: Index, reached: Float) -> tuple[Index, Float]:
        order, below = lookup.order_at(row, port)
        share = lookup.share(row, order, True, below if lookup.sides == 2 else None)
        return port + 1, reached + share.chance

    def further(port: Index, reached: Float) -> Mask:
        return (reached <= target) & (port < ports)

    port, reached = dr.while_loop((mi.UInt32(0), mi.Float(0.0)), further, body)
    # of listed light, the last port's order may not propagate: no light
    return *lookup.order_at(row, dr.select(port > 0, port - 1, 0)), reached > target


class OrderLobe:
    """Lobe of an order (m_x, m_y) under the coherence window, in units of orders.

    Attributes
    ----------
    sigma : standard deviation σ of the amplitude window, µm.
    periods : along x and y, µm, one number for both of grooves; period : the longer one.
    crossed : whether orders leave along y, too.
    lookup : of the table.
    """

    def __init__(self, table: OrderTable, coherence_width: float) -> None:
        self.sigma, self.period = sigma_of(coherence_width), table.period
        self.crossed = table.crossed
        self.periods = table.periods if self.crossed else (table.period, table.period)
        self.lookup: Any = order_lookup(table)
        self._sharpness = (2.0 * math.pi * self.sigma / self.periods[0]) ** 2
        # where an order's neighbour adds to its lobe
        self._overlaps = [
            0.25 * (2.0 * math.pi * self.sigma / period) ** 2 < REACH for period in self.periods
        ]

    def position(self, uv: Vector2f, wavelength: Float) -> Vector2f:
        """Return the tangential part of ωi + ωo in units of orders."""
        d_x, d_y = self.periods
        return mi.Vector2f(uv.x * d_x, uv.y * d_y) * (1e3 * dr.rcp(wavelength))

    def orders(self, position: Vector2f) -> list[Vector2f]:
        """Return the orders whose lobes reach a position."""
        across = nearest(position.x, self._overlaps[0])
        along = nearest(position.y, self._overlaps[1]) if self.crossed else [mi.Float(0.0)]
        return [mi.Vector2f(m, n) for m in across for n in along]

    def lobe(self, position: Vector2f, order: Vector2f) -> Float:
        """Return exp(−σ²|q − q_m|²), of a position in units of orders."""
        d_x, d_y = self.periods
        along = (position.y - order.y) * (d_x / d_y)
        return order_lobe(position.x - order.x, along, self._sharpness)

    def visible(self, order: Vector2f, pair: Pair, wavelength: Float) -> Float:
        """Return C(X_i) C(X_o) of order 0, 1 of others."""
        zeroth = (order.x == 0.0) & (order.y == 0.0)
        return dr.select(zeroth, pair.visible(self.sigma, wavenumber_of(wavelength)), 1.0)

    def drawn(self, row: Any, wavelength: Float, sample1: Float, sample2: Vector2f) -> Draw:
        """Draw an order of a row, and a direction in its lobe."""
        order, below, valid = draw(self.lookup, row, sample1)
        wide = wavelength * (1e-3 / (2.0 * math.pi * math.sqrt(2.0) * self.sigma))
        spread = mi.warp.square_to_std_normal(minimum(sample2, BELOW_ONE)) * wide
        m_x, m_y = order
        centre = mi.Vector2f(m_x / self.periods[0], m_y / self.periods[1]) * (1e-3 * wavelength)
        return Draw(centre + mi.Vector2f(spread), below, valid)


def wavenumber_of(wavelength: Float) -> Float:
    """Return 2π/λ, rad/µm, of a wavelength in nm."""
    return 2e3 * math.pi * dr.rcp(wavelength)


def nearest(position: Float, overlap: bool) -> list[Float]:
    """Return the nearest order along an axis, and the next one where lobes overlap."""
    order = dr.round(position)
    if not overlap:
        return [order]
    return [order, order + dr.select(position < order, -1.0, 1.0)]


class SpectralLobes:
    """Light of all orders in the variant's channels, and directions drawn by it.

    Of spectral variants, whose rays carry wavelengths, and of mono variants, which have one for
    all. `DaylightLobes` has the same methods for RGB variants.

    wavelength : nm, of mono variants.
    """

    def __init__(self, window: OrderLobe, wavelength: float) -> None:
        self._window, self.lookup = window, window.lookup
        self._fixed = mi.Float(wavelength)
        dr.make_opaque(self._fixed)

    def reflected(
        self, pair: Pair, si: Interaction, below: Below, ctx: Context
    ) -> tuple[Spectrum, Float]:
        """Return f cosθo of a pair, and the density of `draw` per solid angle.

        The density is the mean over wavelengths.

        below : whether ωo lies below a sheet, with the pair's ωo mirrored to above; None without a
            sheet.
        ctx : says whether light comes along ωo (radiance) or along ωi (importance).
        """
        lit: list[Lit] = []
        density = mi.Float(0.0)
        wavelengths = self._wavelengths(si)
        for wavelength in wavelengths:
            row = self.lookup.row(*pair.incident, pair.cos_i, wavelength)
            position = self._window.position(pair.uv, wavelength)
            light, chance, near = mi.Float(0.0), mi.Float(0.0), mi.Mask(False)
            terms = []
            for order in self._window.orders(position):
                lobe = self._window.lobe(position, order)
                share = self.lookup.share(row, order, lobe > 0.0, below)
                near |= lobe > 0.0
                chance = dr.fma(share.chance, lobe, chance)
                lobe = lobe * self._window.visible(order, pair, wavelength)
                light = dr.fma(share.efficiency, lobe, light)
                terms.append((order, lobe, share.efficiency))
            peak = lobe_peak(wavenumber_of(wavelength), self._window.sigma) * pair.cos_o
            lit.append(Lit(row, light * peak, peak, terms))
            density += chance * peak * dr.rcp(maximum(self.lookup.total(row, near), MIN_SUM))
        mean = density * (1.0 / len(wavelengths))
        return self.spectrum(pair, ctx, lit), dr.detach(mean)

    def spectrum(self, pair: Pair, ctx: Context, lit: list[Lit]) -> Spectrum:
        """Return f cosθo of all wavelengths, depolarised in polarised variants."""
        values = [light.value for light in lit]
        return mi.Spectrum(mi.depolarizer(mi.UnpolarizedSpectrum(values)))

    def draw(
        self, incident: Vector2f, cos_i: Float, si: Interaction, sample1: Float, sample2: Vector2f
    ) -> Draw:
        """Draw a direction for light from ωi, given by its tangential part and cosine.

        One of the wavelengths is chosen with equal probability.
        """
        wavelengths = self._wavelengths(si)
        count = float(len(wavelengths))
        number = index_between(dr.floor(sample1 * count), 0.0, count - 1.0)
        wavelength = wavelengths[0]
        for n, other in enumerate(wavelengths[1:], 1):
            wavelength = dr.select(number == float(n), other, wavelength)
        row = self.lookup.row(*incident, cos_i, wavelength)
        return self._window.drawn(row, wavelength, sample1 * count - number, sample2)

    def albedo(self, incident: Vector2f, cos_i: Float, si: Interaction) -> Colour:
        """Return the sum of the orders' efficiencies, of all sides."""
        rows = [self.lookup.row(*incident, cos_i, lam) for lam in self._wavelengths(si)]
        return mi.UnpolarizedSpectrum([self.lookup.total(row) for row in rows])

    def _wavelengths(self, si: Interaction) -> list[Float]:
        return list(si.wavelengths) if mi.is_spectral else [self._fixed]
