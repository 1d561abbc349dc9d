"""Drawing directions where the orders are (Dr.Jit): importance sampling in spatial frequency.

For one wavelength the density of ωo per solid angle is

    [p₀ (σ₀²/π) exp(−σ₀²|q|²) + (1 − p₀) P(cell of q) / area] · k² cosθo,   q = k (ωi + ωo)_xy,

with p₀ the power of order 0 towards the mirror direction and P as in `tables.sampling`.
Dispersion is dealt with by drawing for one wavelength and using the mean of all wavelengths'
densities. Frequencies beyond the horizon belong to no direction: samples that fall there carry
nothing. A little of an even density over the hemisphere bounds the weights where the tables promise
no light, and near the horizon, where that density vanishes with cosθo and Kirchhoff's BRDF times
cosθo does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..tables import DiffractionTable
from ..tables.sampling import BANDED, SHIFT, proposals
from .arithmetic import clip, float_of, index_of, maximum, minimum
from .memory import float_of_bits, index_between, once_a_table, read, upload
from .types import Buffer, Float, Index, Vector2f, Vector3f

#: Share of the samples drawn evenly over the hemisphere.
EVEN = 0.03
#: Bounds of order 0's share: neither part may starve the other.
LEAST_SHARE = 0.02

#: Stratified samplers may round up to exactly 1, where the normal distribution is infinite.
BELOW_ONE = float(np.nextafter(np.float32(1.0), np.float32(0.0)))

_SMALLEST = float(np.finfo(np.float32).tiny)


class Strategy(NamedTuple):
    """Parameters of drawing frequencies for one direction of incidence.

    Attributes
    ----------
    share : share of the samples that order 0 gets.
    band : number of the band of κ whose density the other orders are drawn from.
    unit : factor from the band's stored levels to densities.
    """

    share: Float
    band: Index
    unit: Float


class Strategies:
    """Strategies of a table's densities, by κ and direction of incidence.

    Parameters
    ----------
    units : (bands,) factors of `Strategy`; 0 where order 0 has all power.
    order_0 : (n,) power of order 0 over κ, even from 0 to `kappa_max`.
    kappa_max : largest κ, in the unit of the κ that are looked up.
    """

    def __init__(
        self, units: NDArray[np.float32], order_0: NDArray[np.float32], kappa_max: float
    ) -> None:
        self._units, self._order_0 = upload(mi.Float, units), upload(mi.Float, order_0)
        self._last_band, self._last = len(units) - 1.0, len(order_0) - 1.0
        self._bands_per_kappa = len(units) / (BANDED * kappa_max)
        self._steps_per_kappa = self._last / kappa_max

    def at(self, kappa: Float, cos_i: Float) -> Strategy:
        """Choose how to draw for light at this cosine; kappa : k or 1, times the height scale."""
        position = kappa * (cos_i + 0.5) * self._bands_per_kappa
        band = index_of(index_between(position, 0.0, self._last_band))
        nearest = dr.fma(2.0 * kappa * cos_i, self._steps_per_kappa, 0.5)
        power = read(mi.Float, self._order_0, index_of(index_between(nearest, 0.0, self._last)))
        share = order_0_share(power, cos_i)
        unit = read(mi.Float, self._units, band)
        return Strategy(dr.select(unit > 0.0, share, 1.0), band, unit)


class OrderSampler:
    """Sampler of spatial frequencies for one wavelength, and its density."""

    def __init__(self, table: DiffractionTable) -> None:
        densities = proposals(table)
        self._sigma, self._sigma_0 = table.sigma, table.sigma_0
        self._origin, self._cell = densities.origin, densities.cell
        self._rows, self._columns = densities.columns.shape[1], densities.columns.shape[2] - 1
        self._words = densities.levels.shape[2] // 4
        self._row_sums = upload(mi.Float, densities.rows)
        self._column_sums = upload(mi.Float, densities.columns)
        self._levels = upload(mi.UInt32, densities.levels.view(np.uint32))
        self._lobes = densities.lobes
        # Share of a window's lobe that lies within a cell, when the lobe is at its centre
        self._within = [math.erf(0.5 * table.sigma * cell) for cell in densities.cell]
        largest = [
            table.sigma / (math.sqrt(math.pi) * within) if lobe else 1.0 / cell
            for lobe, within, cell in zip(self._lobes, self._within, densities.cell, strict=True)
        ]
        units = densities.units * np.float32(largest[0] * largest[1])
        self.strategies = Strategies(units, densities.order_0, table.expansion.kappa_max)

    def density(self, q: Vector2f, strategy: Strategy) -> Float:
        """Density of drawing the frequency q, per (rad/µm)²."""
        variance, sharp = self._sigma**2, self._sigma_0**2
        glossy = dr.exp2(dr.squared_norm(q) * (-sharp / math.log(2.0))) * (sharp / dr.pi)
        x, y = (
            dr.fma(part, 1.0 / cell, -origin / cell)
            for part, cell, origin in zip(q, self._cell, self._origin, strict=True)
        )
        inside = (x >= 0.0) & (y >= 0.0) & (x < self._columns) & (y < self._rows)
        column, row = index_of(dr.select(inside, x, 0.0)), index_of(dr.select(inside, y, 0.0))
        index = (strategy.band * self._rows + row) * self._words + column // 4
        level = (read(mi.UInt32, self._levels, index, inside) >> (8 * (column & 3))) & 255
        cell = strategy.unit * float_of_bits(level << SHIFT)
        if any(self._lobes):
            apart = mi.Float(0.0)
            for position, number, n in ((x, column, 0), (y, row, 1)):
                if self._lobes[n]:
                    apart += dr.square((position - float_of(number) - 0.5) * self._cell[n])
            cell *= dr.exp2(apart * (-variance / math.log(2.0)))
        return dr.lerp(cell, glossy, strategy.share)

    def draw(
        self, k: Float, cos_i: Float, height_scale: Float, sample1: Float, sample2: Vector2f
    ) -> Vector2f:
        """A frequency (mi.Vector2f, rad/µm) for wavenumber k from three uniform numbers."""
        share, band, _ = self.strategies.at(k * height_scale, cos_i)
        sample2 = minimum(sample2, BELOW_ONE)
        glossy = mi.warp.square_to_std_normal(sample2) * (1.0 / (self._sigma_0 * dr.sqrt(2.0)))
        start = band * (self._rows + 1)
        row, y = invert(self._row_sums, start, self._rows, self._rows, sample2.y)
        start = (band * self._rows + row) * (self._columns + 1)
        column, x = invert(self._column_sums, start, self._columns, self._columns, sample2.x)
        position = mi.Vector2f(self._place(column, x, 0), self._place(row, y, 1))
        return dr.select(sample1 < share, mi.Vector2f(glossy), position)

    def _place(self, number: Index, t: Float, axis: int) -> Float:
        """The frequency along an axis at a share t (0 … 1) of a cell's probability."""
        if self._lobes[axis]:
            distance = dr.erfinv(dr.fma(2.0, t, -1.0) * self._within[axis]) * (1.0 / self._sigma)
            t = dr.fma(distance, 1.0 / self._cell[axis], 0.5)
        return dr.fma(float_of(number) + t, self._cell[axis], self._origin[axis])


def order_0_share(power: Float, cos_i: Float) -> Float:
    """Share of the samples for order 0, from its share of the power towards the mirror direction.

    Other directions see a larger κ, towards the normal (1 + cosθi)/(2 cosθi) times as large, and
    the orders of a gentle surface grow with its square. But not all light goes there: the square
    root of that growth is between the two, and it is the share of least variance.
    """
    others = (1.0 - power) * (1.0 + cos_i)
    share = power * dr.rcp(dr.fma(0.5 * dr.rcp(maximum(cos_i, 1e-4)), others, power))
    return clip(share, LEAST_SHARE, 1.0 - LEAST_SHARE)


def direction_of(tangential: Vector2f) -> Vector3f:
    """Return the unit vector with this tangential part; z is −1 beyond the horizon."""
    squared = dr.squared_norm(tangential)
    cos = dr.select(squared <= 1.0, dr.safe_sqrt(1.0 - squared), -1.0)
    return mi.Vector3f(tangential.x, tangential.y, cos)


def drawn(by_orders: Callable[[Float], Vector3f], sample1: Float, sample2: Vector2f) -> Vector3f:
    """Draw a direction by the orders, from what a share of `sample1` leaves, or a few evenly."""
    remaining = dr.maximum((sample1 - EVEN) * (1.0 / (1.0 - EVEN)), 0.0)
    even = mi.warp.square_to_uniform_hemisphere(sample2)
    return dr.select(sample1 < EVEN, even, by_orders(remaining))


def with_even_share(density: Float) -> Float:
    """Return the density of `drawn` from the density of drawing by the orders."""
    return dr.lerp(density, dr.inv_two_pi, EVEN)


def invert(
    sums: Buffer, start: Index, count: Index | int, most: int, sample: Float
) -> tuple[Index, Float]:
    """Index whose cumulative interval holds the sample, and where in it (0 … 1).

    Parameters
    ----------
    sums : cumulative probabilities, `count` + 1 of them from `start` on.
    most : upper bound of `count`.
    sample : 0 … 1.
    """
    index = mi.UInt32(0)
    for bit in reversed(range(max(most - 1, 1).bit_length())):
        further = index + (1 << bit)
        lower = read(mi.Float, sums, start + dr.minimum(further, count))
        index = dr.select((further < count) & (lower <= sample), further, index)
    lower = read(mi.Float, sums, start + index)
    upper = read(mi.Float, sums, start + index + 1)
    width = maximum(upper - lower, _SMALLEST)
    return index, clip((sample - lower) / width, 0.0, 1.0)


#: The sampler of a table in the current variant's memory.
order_sampler = once_a_table(OrderSampler)
