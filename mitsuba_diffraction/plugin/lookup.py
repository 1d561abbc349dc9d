"""Reading a table inside a Dr.Jit kernel: a few gathers, no Fourier transform.

The twin of `tables.lookup`, which says what is summed. All terms of one bin are contiguous and
aligned, so that one packet load fetches them: this alignment alone is worth a factor of two.
"""

from __future__ import annotations

import weakref
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..tables.expansion import Expansion
from ..tables.table import DiffractionTable
from ..tables.window import first_tap
from .restricted import RestrictedTable
from .scalar_lookup import ScalarTable

#: Largest number of floats that one packet load fetches.
_PACKET = 16
#: Look-ups of more taps run through their rows in a loop instead of one long program.
_UNROLLED_TAPS = 36
#: Dr.Jit's indices are 32 bits wide.
_MOST_PACKETS = 2**31

_uploaded: weakref.WeakKeyDictionary[
    DiffractionTable, dict[str, DeviceTable | ScalarTable | RestrictedTable]
] = weakref.WeakKeyDictionary()


class DeviceTable:
    """A table's coefficients in the memory of the current variant, and how to look them up."""

    def __init__(self, table: DiffractionTable) -> None:
        self.expansion, self.grid = table.expansion, table.grid
        self.spacing, self.reach = table.spacing, table.radius
        self.components = table.coefficients.shape[3]
        self.terms = _padded(table.expansion.terms)
        self.half = table.coefficients.dtype == np.float16
        self._inverse_scale = 1.0 / table.scale
        self.rows, self.columns = (2 * n + 1 for n in table.grid.last[::-1])
        floats = self.components * self.terms
        self._packet = min(_PACKET, floats & -floats)  # largest power of two that divides it
        self._packets = floats // self._packet
        if table.coefficients.size // table.expansion.terms * self._packets >= _MOST_PACKETS:
            raise DiffractionError(
                f"a table of {table.nbytes / 1e9:.1f} GB is too large to index; raise tolerance "
                "or use a smaller patch"
            )
        scalar = mi.Float16 if self.half else mi.Float
        self._coefficients = upload(scalar, _pad(table.coefficients, self.terms))
        self._order_0 = upload(mi.Float, _pad(table.order_0, self.terms))

    def window_sum(self, qx: Any, qy: Any, kappa: Any) -> Any:
        """Σ over orders under the window, dimensionless (`tables.lookup.window_sum`).

        qx, qy, kappa : mi.Float, rad/µm. Outside the table the result is NaN, never a guess.
        """
        grid, expansion = self.grid, self.expansion
        inside = (dr.square(qx) + dr.square(qy) <= (self.reach * (1 + 1e-6)) ** 2) & (
            kappa <= expansion.kappa_max * (1 + 1e-6)
        )
        offset, interval = series_interval(self.expansion, kappa)
        weights = series_weights(expansion, self.terms, offset, interval, kappa)

        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        first, weight_x, weight_y = self._place(x, y, interval)
        weights_x = [weight_x(n) for n in range(grid.taps[0])]

        lobe_x, lobe_y = grid.order_0_exponents
        lobe = dr.exp2(dr.fma(_log2(lobe_x), dr.square(x), _log2(lobe_y) * dr.square(y)))
        centre = self._centre(interval, weights)

        if self.components == 2 and not grid.coherent:
            total = self._over_taps(
                first, weights_x, weight_y, lambda packets: self._squares(packets, weights)
            )[0]
            power = sum((dr.square(c) for c in centre), mi.Float(0.0))
            result = dr.fma(lobe, power, total * self._inverse_scale**2)
        else:
            packets = self._over_taps(first, weights_x, weight_y, lambda packets: packets)
            parts = [
                dr.fma(lobe, c, self._inner(part, weights) * self._inverse_scale)
                for c, part in zip(centre, self._components(packets), strict=True)
            ]
            if grid.coherent:
                result = dr.square(parts[0]) + dr.square(parts[1])
            else:
                result = dr.maximum(parts[0], 0.0)  # a cut series may dip below zero by its error
        return dr.select(inside, result, dr.nan)

    def first_bin(self, qx: Any, qy: Any, kappa: Any) -> Any:
        """Index of the first bin that `window_sum` reads (for benchmarks)."""
        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        return self._place(x, y, series_interval(self.expansion, kappa)[1])[0]

    def read(self, index: Any) -> list[Any]:
        """All floats of the bin with this index, in packets."""
        return self._load(self._coefficients, index, mi.ArrayXf16 if self.half else mi.ArrayXf)

    def order_0(self, kappa: Any) -> Any:
        """|a_0(κ)|², the power of order 0."""
        offset, interval = series_interval(self.expansion, kappa)
        weights = series_weights(self.expansion, self.terms, offset, interval, kappa)
        centre = self._centre(interval, weights)
        if self.components == 2:
            return dr.square(centre[0]) + dr.square(centre[1])
        return dr.maximum(centre[0], 0.0)

    def _place(self, x: Any, y: Any, interval: Any) -> tuple[Any, Any, Any]:
        """Index of the first bin read at (x, y) in bins; weights along x and y as functions."""
        grid = self.grid
        column, weight_x = _taps(x, grid.last[0], grid.taps[0], grid.exponents[0])
        row, weight_y = _taps(y, grid.last[1], grid.taps[1], grid.exponents[1])
        return (interval * self.rows + row) * self.columns + column, weight_x, weight_y

    def _centre(self, interval: Any, weights: list[Any]) -> list[Any]:
        """Order 0: its power, or the parts of its amplitude."""
        packets = self._load(self._order_0, interval, mi.ArrayXf)
        centre = [self._inner(part, weights) for part in self._components(packets)]
        factored = interval == 0 if self.expansion.basis == "chebyshev" else mi.Mask(True)
        centre[0] += dr.select(factored, mi.Float(1.0), 0.0)
        return centre

    def _over_taps(self, first: Any, weights_x: list[Any], weight_y: Any, of: Any) -> list[Any]:
        """Σ over the taps of their Gaussian weights times of(packets)."""
        rows, columns = self.grid.taps[1], self.grid.taps[0]

        def row_sum(start: Any) -> list[Any]:
            total: list[Any] = []
            for i in range(columns):
                packets = of(self.read(start + i))
                if i == 0:
                    total = [p * weights_x[i] for p in packets]
                else:
                    total = [
                        dr.fma(p, weights_x[i], t) for p, t in zip(packets, total, strict=True)
                    ]
            return total

        if rows * columns > _UNROLLED_TAPS:
            start = (mi.UInt32(0), first, [p * 0.0 for p in row_sum(first)])
            _, _, total = dr.while_loop(
                start,
                lambda j, index, total: j < rows,
                lambda j, index, total: (
                    j + 1,
                    index + self.columns,
                    [
                        dr.fma(p, weight_y(mi.Float(j)), t)
                        for p, t in zip(row_sum(index), total, strict=True)
                    ],
                ),
            )
            return total
        total = [p * weight_y(0) for p in row_sum(first)]
        for j in range(1, rows):
            weight = weight_y(j)
            packets = row_sum(first + j * self.columns)
            total = [dr.fma(p, weight, t) for p, t in zip(packets, total, strict=True)]
        return total

    def _load(self, source: Any, index: Any, kind: Any) -> list[Any]:
        """All floats of one bin, as packets."""
        shape = (self._packet, dr.width(index))
        packets = []
        for n in range(self._packets):
            packet = dr.gather(kind, source, index * self._packets + n, shape=shape)
            packets.append(packet if kind is mi.ArrayXf else mi.ArrayXf(packet))
        return packets

    def _components(self, packets: list[Any]) -> list[list[Any]]:
        """The terms of each component, from packets that hold one component after the other."""
        values = [packet[n] for packet in packets for n in range(self._packet)]
        return [values[c * self.terms : (c + 1) * self.terms] for c in range(self.components)]

    def _inner(self, terms: list[Any], weights: list[Any]) -> Any:
        total = terms[0] * weights[0]
        for term, weight in zip(terms[1:], weights[1:], strict=True):
            total = dr.fma(term, weight, total)
        return total

    def _squares(self, packets: list[Any], weights: list[Any]) -> list[Any]:
        """|a_j|² of one bin."""
        real, imaginary = (self._inner(part, weights) for part in self._components(packets))
        return [dr.fma(real, real, dr.square(imaginary))]


def series_interval(expansion: Expansion, kappa: Any) -> tuple[Any, Any]:
    """Where in its interval κ lies (0 … 1), and the interval."""
    position = kappa * (1.0 / expansion.length)
    lower = index_between(dr.floor(position), 0.0, expansion.intervals - 1.0)
    return position - lower, mi.UInt32(lower)


def series_weights(
    expansion: Expansion, terms: int, offset: Any, interval: Any, kappa: Any
) -> list[Any]:
    """What each term is multiplied with; `offset` is 0 … 1 within the interval."""
    if expansion.basis == "taylor":
        x = kappa * expansion.half_range
        weights = [x]
        for n in range(2, terms + 1):
            weights.append(weights[-1] * x * (1.0 / n))
        return weights
    t = dr.clip(dr.fma(2.0, offset, -1.0), -1.0, 1.0)
    factor = offset if expansion.kind == "amplitude" else dr.square(offset)
    scale = dr.select(interval == 0, factor, 1.0)
    weights = [scale, scale * t]  # Tₙ(t) by their recurrence, the factor carried along
    while len(weights) < terms:
        weights.append(dr.fma(2.0 * t, weights[-1], -weights[-2]))
    return weights


def device_table(table: DiffractionTable) -> DeviceTable | ScalarTable | RestrictedTable:
    """The table in the current variant's memory, uploaded once for all BSDFs that share it."""
    variants = _uploaded.setdefault(table, {})
    if mi.variant() not in variants:
        kind: Any = DeviceTable if dr.is_jit_v(mi.Float) else ScalarTable
        device = kind(table)
        if table.coarse is not None:
            coarse = kind(table.coarse)
            device = RestrictedTable(device, coarse, table.radius, table.expansion.kappa_max)
        variants[mi.variant()] = device
    return variants[mi.variant()]


def _taps(position: Any, last: int, taps: int, exponent: float) -> tuple[Any, Any]:
    """Array index of the first tap, and the weight of tap n as a function."""
    base = dr.floor(position) if taps % 2 == 0 else dr.floor(position + 0.5)
    first = base + first_tap(taps)
    # Frequencies beyond the bins see the zeros at the margin, which is as wide as the taps
    index = mi.UInt32(index_between(first + last, 0.0, 2.0 * last + 1 - taps))
    offset = position - first
    return index, lambda n: dr.exp2(_log2(exponent) * dr.square(offset - n))


def index_between(value: Any, low: float, high: float) -> Any:
    """The value clipped to an index's range; NaN, as from a degenerate mesh, becomes `low`.

    `dr.clip` would keep the NaN, and what an integer makes of it reads far outside the table.
    """
    return dr.fmin(dr.fmax(value, low), high)


def _log2(exponent: float) -> float:
    """Factor of the exponent of 2 that makes exp(−exponent·Δ²)."""
    return -exponent / float(np.log(2.0))


def _padded(terms: int) -> int:
    """Terms as stored on the device: 1, 2, 4 or a multiple of 4, of 8 from 17 on."""
    if terms <= 2:
        return terms
    step = 4 if terms <= 16 else 8
    return -(-terms // step) * step


def _pad(coefficients: NDArray[np.floating], terms: int) -> NDArray[np.floating]:
    missing = terms - coefficients.shape[-1]
    return np.pad(coefficients, [(0, 0)] * (coefficients.ndim - 1) + [(0, missing)])


def upload(kind: Any, values: NDArray[np.generic]) -> Any:
    """A Dr.Jit array in memory of Dr.Jit's own, which starts at a cache line.

    On the CPU an array made from NumPy's may go on using NumPy's memory: aligned by chance, and
    mistaken for other arrays when a function recorded by `dr.freeze` runs again. Scalar variants
    have no such arrays: there it stays NumPy's.
    """
    if not dr.is_jit_v(mi.Float):
        return values.ravel()
    array = kind(values.ravel()) * dr.opaque(kind, 1)
    dr.eval(array)
    return array


def read(kind: Any, source: Any, index: Any) -> Any:
    """One number of what `upload` made."""
    if not dr.is_jit_v(mi.Float):
        return kind(source[index])
    return dr.gather(kind, source, index)
