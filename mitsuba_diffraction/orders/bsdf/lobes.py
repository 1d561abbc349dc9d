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
from ..lookup import RAISED, Lookup
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
    terms: list[tuple[Any, Float, Float]]


class Draw(NamedTuple):
    """Tangential part of ωi + ωo in the patch's frame, drawn.

    below : whether ωo lies below a sheet.
    valid : whether there is any light.
    """

    uv: Vector2f
    below: Mask
    valid: Mask


#: Against division by 0, in single precision.
_MIN_DIVISOR, _SMALLEST = 1e-7, 2.0**-126


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
    return lookup_in(table, Device, coated=True, elements=elements, chances=True)


def draw(lookup: Lookup, row: Any, sample: Float) -> tuple[Any, Mask, Mask]:
    """Draw an order by its efficiency over `Lookup.total`.

    Returns the order, whether it leaves on the second side, and whether there is any.
    """
    if lookup.has_chances:
        return _drawn_at_a_corner(lookup, row, sample)
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


def _drawn_at_a_corner(lookup: Lookup, row: Any, sample: Float) -> tuple[Any, Mask, Mask]:
    """Draw a corner of a cell by its part of the sum, then an order by the chances at that node.

    Interpolation mixes the corners, so that both draws have the interpolated chances; and the
    orders of a node lie side by side in memory.
    """
    target, mirrored = sample * lookup.total(row), mi.Mask(False)
    if lookup.coated:  # the face's mirror direction comes first
        mirrored = target < row.face * RAISED
        target = (target - row.face * RAISED) * dr.rcp(dr.maximum(row.entering, _MIN_DIVISOR))
    node, rest, found, before = mi.UInt32(0), mi.Float(0.0), mi.Mask(False), mi.Float(0.0)
    corners = zip(lookup.nodes(row), row.weights, lookup.totals(row), strict=True)
    for corner, weight, total in corners:
        raised = weight * RAISED
        after = dr.fma(raised, total, before)
        here = (target >= before) & (target < after)
        node = dr.select(here, corner, node)
        rest = dr.select(here, (target - before) * dr.rcp(dr.maximum(raised, _SMALLEST)), rest)
        found, before = found | here, after
    ports = mi.UInt32(lookup.ports(row))
    records = (ports + 7) >> 3
    first = lookup.memory.start("chance_starts", row.kind) + (node * ports + row.entered) * records

    def body(n: Index, port: Index, reached: Float) -> tuple[Index, Index, Float]:
        for i, chance in enumerate(lookup.memory.read("chances", first + n, 8, row.lit)):
            port = dr.select(reached <= rest, n * 8 + i, port)
            reached = reached + chance
        return n + 1, port, reached

    def further(n: Index, port: Index, reached: Float) -> Mask:
        return (reached <= rest) & (n < records)

    state = mi.UInt32(0), mi.UInt32(0), mi.Float(0.0)
    _, port, reached = dr.while_loop(state, further, body)
    order, below = lookup.order_at(row, port)
    valid = found & (reached > rest)
    return dr.select(mirrored, 0.0, order), mi.Mask(below) & ~mirrored, valid | mirrored


class OrderLobe:
    """Lobe of an order under the coherence window, in units of orders.

    An order is a whole number; on a crossed grating a vector of two.

    Attributes
    ----------
    sigma : standard deviation σ of the amplitude window, µm.
    periods : along x and y, µm, one number for both of grooves; period : the longer one.
    crossed : whether orders are vectors.
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
        scale, (d_x, d_y) = 1e3 * dr.rcp(wavelength), self.periods
        if not self.crossed:
            return uv * (d_x * scale)
        return mi.Vector2f(uv.x * d_x, uv.y * d_y) * scale

    def orders(self, position: Vector2f) -> list[Any]:
        """Return the orders whose lobes reach a position."""
        across = nearest(position.x, self._overlaps[0])
        if not self.crossed:
            return across
        along = nearest(position.y, self._overlaps[1])
        return [mi.Vector2f(m, n) for m in across for n in along]

    def lobe(self, position: Vector2f, order: Any) -> Float:
        """Return exp(−σ²|q − q_m|²), of a position in units of orders."""
        if not self.crossed:
            return order_lobe(position.x - order, position.y, self._sharpness)
        d_x, d_y = self.periods
        along = (position.y - order.y) * (d_x / d_y)
        return order_lobe(position.x - order.x, along, self._sharpness)

    def visible(self, order: Any, pair: Pair, wavelength: Float) -> Float:
        """Return C(X_i) C(X_o) of order 0, 1 of others."""
        zeroth = (order.x == 0.0) & (order.y == 0.0) if self.crossed else order == 0.0
        return dr.select(zeroth, pair.visible(self.sigma, wavenumber_of(wavelength)), 1.0)

    def mirrored(self) -> Any:
        """Return order 0."""
        return mi.Vector2f(0.0, 0.0) if self.crossed else mi.Float(0.0)

    def centre(self, order: Any, wavelength: Float) -> Vector2f:
        """Return the tangential part of ωi + ωo at an order's centre."""
        d_x, d_y = self.periods
        if not self.crossed:
            return mi.Vector2f(order * wavelength * (1e-3 / d_x), 0.0)
        return mi.Vector2f(order[0] / d_x, order[1] / d_y) * (1e-3 * wavelength)

    def drawn(self, row: Any, wavelength: Float, sample1: Float, sample2: Vector2f) -> Draw:
        """Draw an order of a row, and a direction in its lobe."""
        order, below, valid = draw(self.lookup, row, sample1)
        wide = wavelength * (1e-3 / (2.0 * math.pi * math.sqrt(2.0) * self.sigma))
        spread = mi.warp.square_to_std_normal(minimum(sample2, BELOW_ONE)) * wide
        return Draw(self.centre(order, wavelength) + mi.Vector2f(spread), below, valid)


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
