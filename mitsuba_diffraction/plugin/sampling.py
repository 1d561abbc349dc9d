"""Drawing directions where the orders are (Dr.Jit): importance sampling in spatial frequency.

For one wavelength the density of ωo per solid angle is

    [p₀ (σ²/π) exp(−σ²|q|²) + (1 − p₀) P(cell of q) / cell²] · k² cosθo,   q = k (ωi + ωo)_xy,

with p₀ the power of order 0 towards the mirror direction and P as in `tables.proposals`. Dispersion
is dealt with by drawing for one wavelength and using the mean of all wavelengths' densities. A
little of the cosine density bounds the weights where the tables promise no light.
"""

from __future__ import annotations

import weakref
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..tables.proposals import BANDED, BANDS, proposals
from ..tables.table import DiffractionTable
from .lookup import device_table, index_between, read, upload

#: Share of the samples drawn from the cosine density.
COSINE = 0.03
#: Bounds of order 0's share: neither part may starve the other.
LEAST_SHARE = 0.02

#: Stratified samplers may round up to exactly 1, where the normal distribution is infinite.
BELOW_ONE = float(np.nextafter(np.float32(1.0), np.float32(0.0)))

_SMALLEST = float(np.finfo(np.float32).tiny)

_samplers: weakref.WeakKeyDictionary[DiffractionTable, dict[str, OrderSampler]] = (
    weakref.WeakKeyDictionary()
)


class OrderSampler:
    """Draws spatial frequencies for one wavelength, and says how densely."""

    def __init__(self, table: DiffractionTable) -> None:
        found = proposals(table)
        self._device = device_table(table)
        self._sigma = table.sigma
        self._origin, self._cell = found.origin, found.cell
        self._rows, self._columns = found.columns.shape[1], found.columns.shape[2] - 1
        self._row_sums = upload(mi.Float, found.rows)
        self._column_sums = upload(mi.Float, found.columns)
        self._occupied = upload(mi.Float, found.occupied.astype("float32"))
        self._bands_per_kappa = BANDS / (BANDED * table.expansion.kappa_max)

    def order_0_share(self, k: Any, cos_i: Any, height_scale: Any) -> tuple[Any, Any]:
        """Share of the samples that order 0 gets, and the band of the other orders."""
        band = mi.UInt32(
            index_between(
                k * height_scale * (cos_i + 0.5) * self._bands_per_kappa, 0.0, BANDS - 1.0
            )
        )
        power = self._device.order_0(2.0 * k * height_scale * cos_i)
        share = dr.clip(power, LEAST_SHARE, 1.0 - LEAST_SHARE)
        return dr.select(read(mi.Float, self._occupied, band) > 0.0, share, 1.0), band

    def density(self, qx: Any, qy: Any, k: Any, cos_i: Any, cos_o: Any, height_scale: Any) -> Any:
        """Density per solid angle of drawing the frequency (qx, qy) for wavenumber k."""
        share, band = self.order_0_share(k, cos_i, height_scale)
        variance = self._sigma**2
        glossy = variance / dr.pi * dr.exp(-variance * (dr.square(qx) + dr.square(qy)))
        x = (qx - self._origin[0]) * (1.0 / self._cell)
        y = (qy - self._origin[1]) * (1.0 / self._cell)
        inside = (x >= 0.0) & (y >= 0.0) & (x < self._columns) & (y < self._rows)
        column, row = mi.UInt32(dr.select(inside, x, 0.0)), mi.UInt32(dr.select(inside, y, 0.0))
        cell = self._difference(self._row_sums, band * (self._rows + 1) + row) * self._difference(
            self._column_sums, (band * self._rows + row) * (self._columns + 1) + column
        )
        cell = dr.select(inside, cell * (1.0 / self._cell**2), 0.0)
        return dr.lerp(cell, glossy, share) * dr.square(k) * cos_o

    def draw(self, k: Any, cos_i: Any, height_scale: Any, sample1: Any, sample2: Any) -> Any:
        """A frequency (mi.Vector2f, rad/µm) for wavenumber k from three uniform numbers."""
        share, band = self.order_0_share(k, cos_i, height_scale)
        sample2 = dr.minimum(sample2, BELOW_ONE)
        glossy = mi.warp.square_to_std_normal(sample2) * (1.0 / (self._sigma * dr.sqrt(2.0)))
        start = band * (self._rows + 1)
        row, y = invert(self._row_sums, start, self._rows, self._rows, sample2.y)
        start = (band * self._rows + row) * (self._columns + 1)
        column, x = invert(self._column_sums, start, self._columns, self._columns, sample2.x)
        position = mi.Vector2f(mi.Float(column) + x, mi.Float(row) + y) * self._cell
        position += mi.Vector2f(self._origin[0], self._origin[1])
        return dr.select(sample1 < share, mi.Vector2f(glossy), position)

    def _difference(self, sums: Any, index: Any) -> Any:
        return read(mi.Float, sums, index + 1) - read(mi.Float, sums, index)


def invert(sums: Any, start: Any, count: Any, most: int, sample: Any) -> tuple[Any, Any]:
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
    width = dr.maximum(upper - lower, _SMALLEST)
    return index, dr.clip((sample - lower) / width, 0.0, 1.0)


def order_sampler(table: DiffractionTable) -> OrderSampler:
    """The sampler in the current variant's memory, shared by all BSDFs of the table."""
    variants = _samplers.setdefault(table, {})
    if mi.variant() not in variants:
        variants[mi.variant()] = OrderSampler(table)
    return variants[mi.variant()]
