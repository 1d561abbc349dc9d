"""Look-up of a table inside a Dr.Jit kernel: a few gathers, no Fourier transform.

Twin of `tables.lookup`, which has the sums. All terms of one bin are contiguous and
aligned, so that one packet load fetches them: this alignment alone is worth a factor of two. They
are multiplied with the weights of a series in κ (`plugin.series`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from ..tables import DiffractionTable
from ..tables.layout import BinRecord
from ..tables.powers import as_powers
from ..tables.window import first_tap
from .arithmetic import index_of, maximum
from .height_derivatives import DifferentiableHeights
from .loops import sum_of
from .memory import HalfFloats, index_between, once_a_table, packet_size, read_packets, upload
from .series import Recurrence, Tabulated, inner, series_of
from .types import Float, Index, Mask, Packet, Rotation
from .window_positions import PlacedWindow

#: Look-ups of more taps run through their rows in a loop instead of one long program.
_UNROLLED_TAPS = 36
#: Taps on an axis whose Gaussians follow from each other; more would add up their rounding.
_LONGEST_RATIOS = 6
#: Exponents up to which the first of them is far from the smallest number there is.
_SHALLOW = 30.0
#: Dr.Jit's indices are 32 bits wide.
_MOST_PACKETS = 2**31


def within(qx: Float, qy: Float, radii: tuple[float, float]) -> Mask:
    """Whether frequencies lie in an ellipse, to rounding in single precision."""
    return dr.square(qx * (1.0 / radii[0])) + dr.square(qy * (1.0 / radii[1])) <= 1.0 + 2e-6


class DeviceTable:
    """A table's coefficients in the memory of the current variant, and how to look them up.

    heights : that derivatives are wanted by; `differentiable` then.
    """

    def __init__(
        self, table: DiffractionTable, heights: DifferentiableHeights | None = None
    ) -> None:
        if not table.grid.coherent:
            table = as_powers(table)
        self.expansion, self.grid = table.expansion, table.grid
        self.spacing, self.limited = table.spacing, table.limited
        self.radii, self.q_limit = table.frequency_limit, table.q_limit
        self.record = BinRecord.aligned(*table.coefficients.shape[3:])
        self._inverse_scale = 1.0 / table.scale if heights is None else 1.0
        # order 0's lobe is that of a window `order_0_ratio` times as large in area
        self._ratio = table.order_0_ratio
        self._lobe = [_log2(self._ratio * exponent) for exponent in table.grid.exponents]
        packets_a_bin = self.record.numbers // packet_size(self.record.numbers)
        if table.coefficients.size // table.expansion.terms * packets_a_bin >= _MOST_PACKETS:
            raise DiffractionError(
                f"a table of {table.nbytes / 1e9:.1f} GB is too large to index; raise tolerance "
                "or use a smaller patch"
            )
        records = self.record.pack(table.coefficients)
        self.halves, self.differentiable = None, heights is not None
        if heights is not None:
            self._coefficients, order_0 = heights.coefficients(table, self.record)
            self.series: Recurrence | Tabulated = Recurrence(table, order_0)
        else:
            self.series = series_of(table)
            if records.dtype == np.float16:
                self.halves = HalfFloats(records)
            else:
                self._coefficients = upload(mi.Float, records)
        many = not table.grid.trims and table.grid.taps_read > _UNROLLED_TAPS
        # Dr.Jit 1.5 fails at forward derivatives of memory that several loops read
        self._looped = many and heights is None

    def window_sum(self, qx: Float, qy: Float, kappa: Float) -> Float:
        """Σ over orders under the window, dimensionless (`tables.lookup.window_sum`)."""
        others, zeroth, *cosine = self.window_sums(qx, qy, kappa)
        lengths = [dr.sqrt(maximum(each, 1e-30)) for each in (others, zeroth)]  # with derivatives
        return others + zeroth + sum(2.0 * each * lengths[0] * lengths[1] for each in cosine)

    def window_sums(
        self, qx: Float, qy: Float, kappa: Float, windows: Sequence[PlacedWindow] = ()
    ) -> list[Float]:
        """Return the sum under the window of all orders but 0, and of order 0 (`window_sum`).

        Where amplitudes add up, a third value is the cosine of the phase between both.

        qx, qy, kappa : mi.Float, rad/µm. Frequencies that light cannot probe give NaN; those
            beyond the `frequency_limit` of a table give 0.
        windows : positions of windows; empty for the table's own.
        """
        grid, expansion = self.grid, self.expansion
        inside = within(qx, qy, self.radii) & (kappa <= expansion.kappa_max * (1 + 1e-6))
        interval, weights, order_0 = self.series.at(kappa)

        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        first, across, along = self._place(x, y, interval)

        lobe = dr.exp2(dr.fma(self._lobe[0], dr.square(x), self._lobe[1] * dr.square(y)))
        if self._ratio != 1.0:
            lobe *= self._ratio

        if windows or grid.coherent:
            if windows:
                total = self._over_windows(first, across, along, weights, windows)
            else:
                total = self.amplitude(first, across, along, weights)
            centre = [lobe * c for c in order_0]
            rest = [part * self._inverse_scale for part in total]
            others, zeroth = (dr.square(x) + dr.square(y) for x, y in (rest, centre))
            both = rest[0] * centre[0] + rest[1] * centre[1]
            lengths = [dr.rsqrt(maximum(each, 1e-20)) for each in (others, zeroth)]
            cosine = [both * lengths[0] * lengths[1]]
        else:
            (terms,) = self._components(self._summed_packets(first, across, along))
            others = inner(terms, weights) * self._inverse_scale
            others = maximum(others, 0.0)  # a cut series may dip below zero by its error
            zeroth, cosine = lobe * maximum(order_0[0], 0.0), []
        outside = dr.nan
        if self.limited:
            outside = dr.select(within(qx, qy, (self.q_limit, self.q_limit)), 0.0, dr.nan)
            outside = dr.select(kappa <= expansion.kappa_max * (1 + 1e-6), outside, dr.nan)
        return [dr.select(inside, others, outside), dr.select(inside, zeroth, 0.0), *cosine]

    def amplitude(
        self, first: Index, across: Gaussians, along: Gaussians, weights: list[Float]
    ) -> list[Float]:
        """Return real and imaginary part of the sum of all orders but 0, times the table's scale.

        first : index of the first bin; across, along : weights of the taps along x and y.
        weights : of the terms of the series.
        """
        packets = self._summed_packets(first, across, along)
        return [inner(part, weights) for part in self._components(packets)]

    def first_bin(self, qx: Float, qy: Float, kappa: Float) -> Index:
        """Index of the first bin that `window_sum` reads (for benchmarks)."""
        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        return self._place(x, y, self.series.at(kappa).interval)[0]

    def read(self, index: Index, scale: float = 1.0) -> list[Packet]:
        """Numbers of the bin with this index, in packets.

        scale : factor on half floats, which are over `HalfFloats.scale` without it.
        """
        if self.halves is None:
            return read_packets(self._coefficients, index, self.record.numbers)
        packets = self.halves.read(index)
        return packets if scale == 1.0 else [packet * scale for packet in packets]

    def _unpacked(self, across: Gaussians) -> float:
        """Factor on the numbers of a bin that weights lack."""
        return 1.0 if self.halves is None else self.halves.scale / across.scale

    def _place(self, x: Float, y: Float, interval: Index) -> tuple[Index, Gaussians, Gaussians]:
        """Index of the first bin read at (x, y) in bins; weights of the taps along x and y."""
        grid = self.grid
        # One factor on weights is cheaper than one on all numbers. A derivative by a weight is such
        # a number times a pixel's share of a picture: without the factor, single precision loses it
        scale = 1.0
        if self.halves is not None and not dr.grad_enabled(x, y):
            scale = self.halves.scale
        column, across = _taps(x, grid.last[0], grid.taps[0], grid.exponents[0], scale)
        row, along = _taps(y, grid.last[1], grid.taps[1], grid.exponents[1])
        return grid.index(interval, row, column), across, along

    def _summed_packets(self, first: Index, across: Gaussians, along: Gaussians) -> list[Packet]:
        """Return the terms of all taps, summed with their Gaussian weights."""
        unpacked = self._unpacked(across)

        def add_row(
            start: Index, columns: range, weight: Float, weights_x: Any, total: list[Packet]
        ) -> list[Packet]:
            row: list[Packet] = []
            for i in columns:
                values = self.read(start + i, unpacked)
                if not row:
                    row = [v * weights_x[i] for v in values]
                else:
                    row = [dr.fma(v, weights_x[i], t) for v, t in zip(values, row, strict=True)]
            return [dr.fma(p, weight, t) for p, t in zip(row, total, strict=True)]

        nothing = [dr.zeros(mi.ArrayXf, dr.shape(packet)) for packet in self.read(mi.UInt32(0))]
        return self._over_rows(first, along, add_row, across.all(), nothing)

    def _over_windows(
        self,
        first: Index,
        across: Gaussians,
        along: Gaussians,
        weights: list[Float],
        windows: Sequence[PlacedWindow],
    ) -> list[Float]:
        """Σ over windows and taps of amplitudes turned by exp(−i q·x): real, imaginary part.

        weights : of the terms.
        """
        unpacked = self._unpacked(across)

        def add_row(
            start: Index, columns: range, phases: list[Rotation], inputs: Any, total: list[Float]
        ) -> list[Float]:
            steps, weights = inputs
            sums: list[Rotation] = [(mi.Float(0.0), mi.Float(0.0))] * len(windows)
            for i in columns:
                parts = self._components(self.read(start + i, unpacked))
                value = inner(parts[0], weights), inner(parts[1], weights)
                sums = [_turned(value, x[i], row) for x, row in zip(steps, sums, strict=True)]
            for row, phase in zip(sums, phases, strict=True):
                total = [*_turned(row, phase, total)]
            return total

        steps = [_along(window.steps[0], across.all()) for window in windows]
        start = [dr.fma(across.first, w.turn.x, along.first * w.turn.y) for w in windows]
        phases = Phases(along, list(windows), start)
        nothing = [mi.Float(0.0), mi.Float(0.0)]
        return self._over_rows(first, phases, add_row, (steps, weights), nothing)

    def _over_rows(
        self,
        first: Index,
        factors: Gaussians | Phases,
        add_row: Callable[[Index, range, Any, Any, list[Any]], list[Any]],
        inputs: Any,
        total: list[Any],
    ) -> list[Any]:
        """Add all rows of taps to a total: add_row(first bin, columns, factor, inputs, total)."""
        columns_a_row = self.grid.shape[1]
        if not self._looped:
            rows = zip(self.grid.tapped(), factors.all(), strict=True)
            for j, (columns, factor) in enumerate(rows):
                total = add_row(first + j * columns_a_row, columns, factor, inputs, total)
            return total

        every = range(self.grid.taps[0])

        def body(j: Index, inputs: Any, total: list[Any]) -> list[Any]:
            factors, others = inputs
            factor = factors.at(mi.Float(j))
            return add_row(first + j * columns_a_row, every, factor, others, total)

        return sum_of(self.grid.taps[1], body, (factors, inputs), total)

    def _components(self, packets: list[Packet]) -> list[Sequence[Float]]:
        """The terms of each component, from packets that hold one component after the other."""
        return self.record.split([x for packet in packets for x in packet])


@dataclass
class Gaussians:
    """Weights exp(−e(Δ − n)²) of taps n = 0, 1, 2 …

    Attributes
    ----------
    offset : Δ, the position from the first tap on, in bins.
    first : bin of the first tap.
    count, exponent : number of taps, and e.
    scale : factor on all weights.
    """

    offset: Float
    first: Float
    count: int
    exponent: float
    scale: float = 1.0

    def at(self, n: Float | int) -> Float:
        """Return the weight of tap n."""
        square = dr.square(self.offset - n)
        return dr.exp2(dr.fma(_log2(self.exponent), square, math.log2(self.scale)))

    def all(self) -> list[Float]:
        """Return the weights of all taps."""
        if self.count > _LONGEST_RATIOS or self.exponent * (0.5 * self.count) ** 2 > _SHALLOW:
            return [self.at(n) for n in range(self.count)]
        # their ratios are a geometric series
        weights = [self.at(0)]
        ratio = dr.exp2(_log2(self.exponent) * dr.fma(-2.0, self.offset, 1.0))
        while len(weights) < self.count:
            weights.append(weights[-1] * ratio)
            ratio = ratio * math.exp(-2.0 * self.exponent)
        return weights


@dataclass
class Phases:
    """Rotations of rows of taps by the windows' positions, times the rows' weights.

    Attributes
    ----------
    rows : weights of the rows.
    windows : positions of the windows.
    start : of each window, turns of the first tap.
    """

    rows: Gaussians
    windows: list[PlacedWindow]
    start: list[Float]

    def at(self, n: Float | int) -> list[Rotation]:
        """Return the rotations of row n."""
        row, rotations = self.rows.at(n), []
        for start, window in zip(self.start, self.windows, strict=True):
            sin, cos = _sincos(start + dr.round(-start) + window.turn.y * n)
            rotations.append((cos * (window.weight * row), sin * (window.weight * row)))
        return rotations

    def all(self) -> list[list[Rotation]]:
        """Return the rotations of all rows."""
        phases = []
        for start, window in zip(self.start, self.windows, strict=True):
            sin, cos = _sincos(start)
            phases.append((cos * window.weight, sin * window.weight))
        rotations = []
        for row in self.rows.all():
            rotations.append([(cos * row, sin * row) for cos, sin in phases])
            phases = [_summed(p, w.steps[1]) for p, w in zip(phases, self.windows, strict=True)]
        return rotations


def _sincos(turns: Float) -> tuple[Float, Float]:
    return dr.sincos((turns - dr.round(turns)) * (2.0 * dr.pi))


def _taps(
    position: Float, last: int, taps: int, exponent: float, scale: float = 1.0
) -> tuple[Index, Gaussians]:
    """Array index of the first tap at a position in bins, and the weights of all taps."""
    first = dr.floor(position if taps % 2 == 0 else position + 0.5) + first_tap(taps)
    # Frequencies beyond the bins see the zeros at the margin, which is as wide as the taps
    index = index_of(index_between(first + last, 0.0, 2.0 * last + 1 - taps))
    return index, Gaussians(position - first, first, taps, exponent, scale)


def _turned(value: Rotation, angle: Rotation, total: Sequence[Float]) -> Rotation:
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


#: The table in the current variant's memory.
device_table = once_a_table(DeviceTable)
