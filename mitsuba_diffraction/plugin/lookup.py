"""Look-up of a table inside a Dr.Jit kernel: a few gathers, no Fourier transform.

Twin of `tables.lookup`, which has the sums. All terms of one bin are contiguous and
aligned, so that one packet load fetches them: this alignment alone is worth a factor of two. They
are multiplied with the weights of a series in κ (`plugin.series`).
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from ..tables.layout import Record
from ..tables.table import DiffractionTable
from ..tables.window import first_tap
from .memory import index_between, packet_size, read_packets, upload
from .series import inner, series_of
from .types import Float, Index, Mask, Packet, Rotation
from .window_positions import Window

#: Look-ups of more taps run through their rows in a loop instead of one long program.
_UNROLLED_TAPS = 36
#: Taps on an axis whose Gaussians follow from each other; more would add up their rounding.
_LONGEST_RATIOS = 6
#: Exponents up to which the first of them is far from the smallest number there is.
_SHALLOW = 30.0
#: Dr.Jit's indices are 32 bits wide.
_MOST_PACKETS = 2**31

#: The weight of a tap, by its number.
Weight = Callable[[Float], Float]

_uploaded: weakref.WeakKeyDictionary[DiffractionTable, dict[str, DeviceTable]] = (
    weakref.WeakKeyDictionary()
)


def within(qx: Float, qy: Float, radii: tuple[float, float]) -> Mask:
    """Whether frequencies lie in an ellipse, to rounding in single precision."""
    return dr.square(qx * (1.0 / radii[0])) + dr.square(qy * (1.0 / radii[1])) <= 1.0 + 2e-6


class DeviceTable:
    """A table's coefficients in the memory of the current variant, and how to look them up."""

    def __init__(self, table: DiffractionTable) -> None:
        self.expansion, self.grid = table.expansion, table.grid
        self.spacing, self.limited = table.spacing, table.limited
        self.radii, self.q_limit = table.frequency_limit, table.q_limit
        self.record = Record.aligned(*table.coefficients.shape[3:])
        self.half = table.coefficients.dtype == np.float16
        self._inverse_scale = 1.0 / table.scale
        packets_a_bin = self.record.numbers // packet_size(self.record.numbers)
        if table.coefficients.size // table.expansion.terms * packets_a_bin >= _MOST_PACKETS:
            raise DiffractionError(
                f"a table of {table.nbytes / 1e9:.1f} GB is too large to index; raise tolerance "
                "or use a smaller patch"
            )
        kind = mi.Float16 if self.half else mi.Float
        self._coefficients = upload(kind, self.record.pack(table.coefficients))
        self.series = series_of(table)
        self._looped = not table.grid.trims and table.grid.taps_read > _UNROLLED_TAPS

    def window_sum(
        self, qx: Float, qy: Float, kappa: Float, windows: Sequence[Window] = ()
    ) -> Float:
        """Σ over orders under the window, dimensionless (`tables.lookup.window_sum`).

        qx, qy, kappa : mi.Float, rad/µm. Frequencies that light cannot probe give NaN; those
            beyond the `frequency_limit` of a table give 0.
        windows : positions of windows; empty for the table's own.
        """
        grid, expansion = self.grid, self.expansion
        inside = within(qx, qy, self.radii) & (kappa <= expansion.kappa_max * (1 + 1e-6))
        interval, weights, order_0 = self.series.at(kappa)

        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        first, weight_x, weight_y = self._place(x, y, interval)
        weights_x = [weight_x(n) for n in range(grid.taps[0])]

        lobe_x, lobe_y = grid.exponents
        lobe = dr.exp2(dr.fma(_log2(lobe_x), dr.square(x), _log2(lobe_y) * dr.square(y)))

        if windows:
            total = self._over_windows(first, (x, y), weights_x, weight_y, weights, windows)
            parts = [
                dr.fma(lobe, c, part * self._inverse_scale)
                for c, part in zip(order_0, total, strict=True)
            ]
            result = dr.square(parts[0]) + dr.square(parts[1])
        elif self.record.components == 2 and not grid.coherent:
            total = self._over_taps(
                first, weights_x, weight_y, lambda packets: self._squares(packets, weights)
            )[0]
            power = sum((dr.square(c) for c in order_0), mi.Float(0.0))
            result = dr.fma(lobe, power, total * self._inverse_scale**2)
        else:
            packets = self._over_taps(first, weights_x, weight_y, lambda packets: packets)
            parts = [
                dr.fma(lobe, c, inner(part, weights) * self._inverse_scale)
                for c, part in zip(order_0, self._components(packets), strict=True)
            ]
            if grid.coherent:
                result = dr.square(parts[0]) + dr.square(parts[1])
            else:
                result = dr.maximum(parts[0], 0.0)  # a cut series may dip below zero by its error
        outside = dr.nan
        if self.limited:
            outside = dr.select(within(qx, qy, (self.q_limit, self.q_limit)), 0.0, dr.nan)
            outside = dr.select(kappa <= expansion.kappa_max * (1 + 1e-6), outside, dr.nan)
        return dr.select(inside, result, outside)

    def first_bin(self, qx: Float, qy: Float, kappa: Float) -> Index:
        """Index of the first bin that `window_sum` reads (for benchmarks)."""
        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        return self._place(x, y, self.series.at(kappa).interval)[0]

    def read(self, index: Index) -> list[Packet]:
        """Numbers of the bin with this index, in packets."""
        return read_packets(self._coefficients, index, self.record.numbers)

    def order_0(self, kappa: Float) -> Float:
        """|a_0(κ)|², the power of order 0."""
        parts = self.series.at(kappa).order_0
        if self.record.components == 2:
            return dr.square(parts[0]) + dr.square(parts[1])
        return dr.maximum(parts[0], 0.0)

    def _place(self, x: Float, y: Float, interval: Index) -> tuple[Index, Weight, Weight]:
        """Index of the first bin read at (x, y) in bins; weights along x and y as functions."""
        grid = self.grid
        column, weight_x = _taps(x, grid.last[0], grid.taps[0], grid.exponents[0])
        row, weight_y = _taps(y, grid.last[1], grid.taps[1], grid.exponents[1], self._looped)
        return grid.index(interval, row, column), weight_x, weight_y

    def _over_taps(
        self,
        first: Index,
        weights_x: list[Float],
        weight_y: Weight,
        of: Callable[[list[Packet]], list[Float]],
    ) -> list[Float]:
        """Σ over the taps of their Gaussian weights times of(packets)."""
        rows, columns_a_row = self.grid.taps[1], self.grid.shape[1]

        def row_sum(start: Index, columns: range) -> list[Float]:
            total: list[Float] = []
            for i in columns:
                values = of(self.read(start + i))
                if not total:
                    total = [v * weights_x[i] for v in values]
                else:
                    total = [dr.fma(v, weights_x[i], t) for v, t in zip(values, total, strict=True)]
            return total

        if self._looped:
            every = range(self.grid.taps[0])
            start = (mi.UInt32(0), first, [p * 0.0 for p in row_sum(first, every)])
            _, _, total = dr.while_loop(
                start,
                lambda j, index, total: j < rows,
                lambda j, index, total: (
                    j + 1,
                    index + columns_a_row,
                    [
                        dr.fma(p, weight_y(mi.Float(j)), t)
                        for p, t in zip(row_sum(index, every), total, strict=True)
                    ],
                ),
            )
            return total
        total = []
        for j, columns in enumerate(self.grid.tapped()):
            row = row_sum(first + j * columns_a_row, columns)
            if not total:
                total = [p * weight_y(j) for p in row]
            else:
                total = [dr.fma(p, weight_y(j), t) for p, t in zip(row, total, strict=True)]
        return total

    def _over_windows(
        self,
        first: Index,
        position: tuple[Float, Float],
        weights_x: list[Float],
        weight_y: Weight,
        weights: list[Float],
        windows: Sequence[Window],
    ) -> Rotation:
        """Σ over windows and taps of amplitudes turned by exp(−i q·x): real, imaginary part.

        position : (x, y) in bins; weights : of the terms.
        """
        rows, columns_a_row = self.grid.taps[1], self.grid.shape[1]
        across = [_along(window.steps[0], weights_x) for window in windows]

        def add_row(
            start: Index, columns: range, weight: Float, phases: list[Rotation], total: Rotation
        ) -> Rotation:
            sums: list[Rotation] = [(mi.Float(0.0), mi.Float(0.0))] * len(windows)
            for i in columns:
                parts = self._components(self.read(start + i))
                value = inner(parts[0], weights), inner(parts[1], weights)
                sums = [_turned(value, x[i], row) for x, row in zip(across, sums, strict=True)]
            for row, (cos, sin) in zip(sums, phases, strict=True):
                total = _turned(row, (cos * weight, sin * weight), total)
            return total

        def next_row(phases: list[Rotation]) -> list[Rotation]:
            pairs = zip(phases, windows, strict=True)
            return [_summed(phase, window.steps[1]) for phase, window in pairs]

        x, y = (_first_bin(p, taps) for p, taps in zip(position, self.grid.taps, strict=True))
        phases = []
        for window in windows:
            turns = dr.fma(x, window.turn.x, y * window.turn.y)
            sin, cos = dr.sincos((turns - dr.round(turns)) * (2.0 * dr.pi))
            phases.append((cos * window.weight, sin * window.weight))
        total = (mi.Float(0.0), mi.Float(0.0))
        if self._looped:
            every = range(self.grid.taps[0])
            state = (mi.UInt32(0), first, phases, total)
            return dr.while_loop(
                state,
                lambda j, index, phases, total: j < rows,
                lambda j, index, phases, total: (
                    j + 1,
                    index + columns_a_row,
                    next_row(phases),
                    add_row(index, every, weight_y(mi.Float(j)), phases, total),
                ),
            )[3]
        for j, columns in enumerate(self.grid.tapped()):
            total = add_row(first + j * columns_a_row, columns, weight_y(j), phases, total)
            phases = next_row(phases)
        return total

    def _components(self, packets: list[Packet]) -> list[Sequence[Float]]:
        """The terms of each component, from packets that hold one component after the other."""
        return self.record.split([x for packet in packets for x in packet])

    def _squares(self, packets: list[Packet], weights: list[Float]) -> list[Float]:
        """|a_j|² of one bin."""
        real, imaginary = (inner(part, weights) for part in self._components(packets))
        return [dr.fma(real, real, dr.square(imaginary))]


def _taps(
    position: Float, last: int, taps: int, exponent: float, looped: bool = False
) -> tuple[Index, Weight]:
    """Array index of the first tap, and the weight of tap n as a function.

    looped : whether the function must accept Dr.Jit variables, not only numbers.
    """
    first = _first_bin(position, taps)
    # Frequencies beyond the bins see the zeros at the margin, which is as wide as the taps
    index = mi.UInt32(index_between(first + last, 0.0, 2.0 * last + 1 - taps))
    offset = position - first
    if looped or taps > _LONGEST_RATIOS or exponent * (0.5 * taps) ** 2 > _SHALLOW:
        return index, lambda n: dr.exp2(_log2(exponent) * dr.square(offset - n))
    # exp(−e(Δ − n)²) of n, n + 1, …: their ratios are a geometric series
    weights = [dr.exp2(_log2(exponent) * dr.square(offset))]
    ratio = dr.exp2(_log2(exponent) * dr.fma(-2.0, offset, 1.0))
    while len(weights) < taps:
        weights.append(weights[-1] * ratio)
        ratio = ratio * math.exp(-2.0 * exponent)
    return index, weights.__getitem__


def _first_bin(position: Float, taps: int) -> Float:
    """The bin of the first tap."""
    return dr.floor(position if taps % 2 == 0 else position + 0.5) + first_tap(taps)


def _turned(value: Rotation, angle: Rotation, total: Rotation) -> Rotation:
    """total + value·exp(−i angle), an angle given by (cos, sin), maybe times a weight."""
    (x, y), (cos, sin) = value, angle
    return dr.fma(x, cos, dr.fma(y, sin, total[0])), dr.fma(y, cos, dr.fma(-x, sin, total[1]))


def _summed(first: Rotation, second: Rotation) -> Rotation:
    """(cos, sin) of the sum of two angles, times their weights."""
    (x, y), (cos, sin) = first, second
    return dr.fma(x, cos, -y * sin), dr.fma(x, sin, y * cos)


def _along(step: Rotation, weights: list[Float]) -> list[Rotation]:
    """(cos, sin) of 0, 1, 2 … steps, times weights."""
    phase: Rotation = (mi.Float(1.0), mi.Float(0.0))
    rotations = []
    for weight in weights:
        rotations.append((phase[0] * weight, phase[1] * weight))
        phase = _summed(phase, step)
    return rotations


def _log2(exponent: float) -> float:
    """Factor of the exponent of 2 that makes exp(−exponent·Δ²)."""
    return -float(exponent) / math.log(2.0)


def device_table(table: DiffractionTable) -> DeviceTable:
    """Return the table in the current variant's memory, uploaded once for all BSDFs."""
    variants = _uploaded.setdefault(table, {})
    if mi.variant() not in variants:
        variants[mi.variant()] = DeviceTable(table)
    return variants[mi.variant()]
