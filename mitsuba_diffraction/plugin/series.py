"""Series in κ inside a Dr.Jit kernel: weights of a bin's terms, and the value of order 0.

The twin of `tables.expansion`. Weights of Chebyshev's and Taylor's series follow from a recurrence;
the functions of basis "svd" have none, and are tabulated, as parabolas on equal cells of κ.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..tables import DiffractionTable
from ..tables.expansion import Expansion
from ..tables.layout import BinRecord, cells_of, functions_at
from .arithmetic import clip, index_of, minimum
from .memory import PACKET, index_between, read_record, upload
from .types import Buffer, Float, Index

#: Share of the tolerance that the cells of tabulated functions may add. A parabola through three
#: points (Chebyshev's nodes) of a cell across which the phase changes by h leaves max|f'''| h³/192.
_CELLS_SHARE = 0.02


class SeriesValue(NamedTuple):
    """A series at one κ.

    Attributes
    ----------
    interval : of κ, in which the coefficients are looked up.
    weights : of a bin's terms, those that fill up its record included.
    order_0 : the power of order 0, or the real and imaginary part of its amplitude.
    """

    interval: Index
    weights: list[Float]
    order_0: list[Float]


class Recurrence:
    """Chebyshev's and Taylor's series.

    order_0 : records of order 0's series in the variant's memory; by default the table's records.
    """

    def __init__(self, table: DiffractionTable, order_0: Buffer | None = None) -> None:
        self._expansion = table.expansion
        self._record = BinRecord.aligned(*table.order_0.shape[1:])
        if order_0 is None:
            order_0 = upload(mi.Float, self._record.pack(table.order_0.astype(np.float32)))
        self._order_0 = order_0

    def at(self, kappa: Float) -> SeriesValue:
        """Evaluate the series at κ in rad/µm."""
        interval, weights = series_weights(self._expansion, self._record.stored, kappa)
        values = read_record(self._order_0, interval, self._record.numbers)
        order_0 = [inner(part, weights) for part in self._record.split(values)]
        factored = mi.Mask(True) if self._expansion.basis == "taylor" else interval == 0
        order_0[0] += dr.select(factored, mi.Float(1.0), 0.0)
        return SeriesValue(interval, weights, order_0)


class Tabulated:
    """Basis "svd": weights and order 0 from tables over κ."""

    def __init__(self, table: DiffractionTable) -> None:
        expansion = table.expansion
        self._expansion = expansion
        self._components = table.order_0.shape[1]
        self._missing = BinRecord.aligned(1, expansion.terms).stored - expansion.terms
        self._cells = cells_of(expansion, (192.0 * _CELLS_SHARE * table.tolerance) ** (1 / 3))
        # Chebyshev's three nodes of every cell, and the parabola a + t (b + t c) through them
        t = 0.5 + 0.5 * np.cos(np.pi * (np.arange(3) + 0.5) / 3)
        start = np.arange(expansion.intervals * self._cells)
        kappa = expansion.length / self._cells * (start[:, None] + t)
        kappa = np.clip(kappa, 0.0, np.nextafter(expansion.kappa_max, 0.0))
        parabola = np.linalg.inv(t[:, None] ** np.arange(3))
        # one record per cell, so that few packets fetch all of it
        functions = functions_at(expansion, kappa), table.order_0_at(kappa)
        numbers = np.einsum("pn,cnt->cpt", parabola, np.concatenate(functions, axis=-1))
        numbers = numbers.reshape(len(start), 1, -1)
        self._record = BinRecord.of(1, numbers.shape[2], unit=PACKET)
        self._parabolas = upload(mi.Float, self._record.pack(numbers.astype(np.float32)))

    def at(self, kappa: Float) -> SeriesValue:
        """Evaluate the series at κ in rad/µm."""
        last = self._expansion.intervals * self._cells - 1.0
        position = kappa * (self._cells / self._expansion.length)
        lower = index_between(dr.floor(position), 0.0, last)
        t = clip(position - lower, 0.0, 1.0)
        cell = index_of(lower)
        numbers = read_record(self._parabolas, cell, self._record.numbers)
        count = self._expansion.terms + self._components
        a, b, c = (numbers[n * count : (n + 1) * count] for n in range(3))
        values = [dr.fma(dr.fma(z, t, y), t, x) for x, y, z in zip(a, b, c, strict=True)]
        weights, order_0 = values[: -self._components], values[-self._components :]
        offset = minimum(kappa * (1.0 / self._expansion.length), 1.0)
        factor = offset if self._expansion.kind == "amplitude" else dr.square(offset)
        interval = mi.UInt32(0)
        if self._expansion.intervals > 1:
            interval = cell // self._cells
            factor = dr.select(interval == 0, factor, 1.0)
        weights = [w * factor for w in weights]
        return SeriesValue(interval, weights + [mi.Float(0.0)] * self._missing, order_0)


def series_of(table: DiffractionTable) -> Recurrence | Tabulated:
    """Upload the series of a table."""
    return Recurrence(table) if table.expansion.functions is None else Tabulated(table)


def series_weights(expansion: Expansion, terms: int, kappa: Float) -> tuple[Index, list[Float]]:
    """Interval of κ, and the factor of each term of its Chebyshev or Taylor series."""
    position = kappa * (1.0 / expansion.length)
    lower = index_between(dr.floor(position), 0.0, expansion.intervals - 1.0)
    offset, interval = position - lower, index_of(lower)
    if expansion.basis == "taylor":
        x = kappa * expansion.half_range
        weights = [x]
        for n in range(2, terms + 1):
            weights.append(weights[-1] * x * (1.0 / n))
        return interval, weights
    t = clip(dr.fma(2.0, offset, -1.0), -1.0, 1.0)
    factor = offset if expansion.kind == "amplitude" else dr.square(offset)
    scale = dr.select(interval == 0, factor, 1.0)
    weights = [scale, scale * t]  # Tₙ(t) by their recurrence, the factor carried along
    while len(weights) < terms:
        weights.append(dr.fma(2.0 * t, weights[-1], -weights[-2]))
    return interval, weights[:terms]


def inner(terms: Sequence[Float], weights: Sequence[Float]) -> Float:
    """Σ terms·weights."""
    total = terms[0] * weights[0]
    for term, weight in zip(terms[1:], weights[1:], strict=True):
        total = dr.fma(term, weight, total)
    return total
