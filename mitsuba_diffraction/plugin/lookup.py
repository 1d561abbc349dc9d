"""Reading a table inside a Dr.Jit kernel: a few gathers, no Fourier transform.

The twin of `tables.lookup`, which says what is summed, and of `tables.expansion`. All terms of one
bin are contiguous and aligned, so that one packet load fetches them: this alignment alone is worth
a factor of two. They are multiplied with a series in κ: Chebyshev's and Taylor's weights follow
from a recurrence; the functions of basis "svd" have none, and are tabulated, as parabolas on equal
cells of κ.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from ..tables.expansion import Expansion
from ..tables.layout import Record, cells_of, functions_at
from ..tables.table import DiffractionTable
from ..tables.window import first_tap
from .memory import PACKET, index_between, packet_size, read_packets, read_record, upload
from .types import Float, Index, Mask, Packet, Rotation
from .window_positions import Window

#: A parabola through three points on a cell of phase h leaves max|f'''| h³/192 (Chebyshev nodes);
#: this share of the tolerance is what the cells may add.
_CELLS_SHARE = 0.02


class Recurrence:
    """Weights of Chebyshev's and Taylor's series."""

    def __init__(self, table: DiffractionTable) -> None:
        self._expansion = table.expansion
        self._record = Record.aligned(*table.order_0.shape[1:])
        self._order_0 = upload(mi.Float, self._record.pack(table.order_0.astype(np.float32)))

    def at(self, kappa: Float) -> tuple[Index, list[Float], list[Float]]:
        """Interval, weights of a bin's terms, and order 0: its power, or the parts of a_0."""
        offset, interval = series_interval(self._expansion, kappa)
        weights = series_weights(self._expansion, self._record.stored, offset, interval, kappa)
        values = read_record(self._order_0, interval, self._record.numbers)
        centre = [inner(part, weights) for part in self._record.split(values)]
        factored = mi.Mask(True) if self._expansion.basis == "taylor" else interval == 0
        centre[0] += dr.select(factored, mi.Float(1.0), 0.0)
        return interval, weights, centre


class Tabulated:
    """Weights of basis "svd", and order 0, from tables over κ."""

    def __init__(self, table: DiffractionTable) -> None:
        expansion = table.expansion
        self._expansion = expansion
        self._components = table.order_0.shape[1]
        self._missing = Record.aligned(1, expansion.terms).stored - expansion.terms
        self._cells = cells_of(expansion, (192.0 * _CELLS_SHARE * table.tolerance) ** (1 / 3))
        # Chebyshev's three nodes of every cell, and the parabola a + t (b + t c) through them
        t = 0.5 + 0.5 * np.cos(np.pi * (np.arange(3) + 0.5) / 3)
        start = np.arange(expansion.intervals * self._cells)
        kappa = expansion.length / self._cells * (start[:, None] + t)
        kappa = np.clip(kappa, 0.0, np.nextafter(expansion.kappa_max, 0.0))
        parabola = np.linalg.inv(t[:, None] ** np.arange(3))
        # one record a cell, so that few packets fetch all of it
        both = np.concatenate([functions_at(expansion, kappa), table.order_0_at(kappa)], axis=-1)
        numbers = np.einsum("pn,cnt->cpt", parabola, both).reshape(len(start), 1, -1)
        self._record = Record.of(1, numbers.shape[2], unit=PACKET)
        self._parabolas = upload(mi.Float, self._record.pack(numbers.astype(np.float32)))

    def at(self, kappa: Float) -> tuple[Index, list[Float], list[Float]]:
        """Interval, weights of a bin's terms, and order 0: its power, or the parts of a_0."""
        last = self._expansion.intervals * self._cells - 1.0
        position = kappa * (self._cells / self._expansion.length)
        lower = index_between(dr.floor(position), 0.0, last)
        t = dr.clip(position - lower, 0.0, 1.0)
        cell = mi.UInt32(lower)
        values = read_record(self._parabolas, cell, self._record.numbers)
        count = self._expansion.terms + self._components
        a, b, c = (values[n * count : (n + 1) * count] for n in range(3))
        found = [dr.fma(dr.fma(z, t, y), t, x) for x, y, z in zip(a, b, c, strict=True)]
        weights, centre = found[: -self._components], found[-self._components :]
        offset = dr.minimum(kappa * (1.0 / self._expansion.length), 1.0)
        factor = offset if self._expansion.kind == "amplitude" else dr.square(offset)
        interval = mi.UInt32(0)
        if self._expansion.intervals > 1:
            interval = cell // self._cells
            factor = dr.select(interval == 0, factor, 1.0)
        weights = [w * factor for w in weights]
        return interval, weights + [mi.Float(0.0)] * self._missing, centre


def series_of(table: DiffractionTable) -> Recurrence | Tabulated:
    """How this table's series is evaluated."""
    return Recurrence(table) if table.expansion.functions is None else Tabulated(table)


def series_interval(expansion: Expansion, kappa: Float) -> tuple[Float, Index]:
    """Where in its interval κ lies (0 … 1), and the interval."""
    position = kappa * (1.0 / expansion.length)
    lower = index_between(dr.floor(position), 0.0, expansion.intervals - 1.0)
    return position - lower, mi.UInt32(lower)


def series_weights(
    expansion: Expansion, terms: int, offset: Float, interval: Index, kappa: Float
) -> list[Float]:
    """What each term of a Chebyshev or Taylor series is multiplied with; `offset` is 0 … 1."""
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
    return weights[:terms]


def inner(terms: Sequence[Float], weights: Sequence[Float]) -> Float:
    """Σ terms·weights."""
    total = terms[0] * weights[0]
    for term, weight in zip(terms[1:], weights[1:], strict=True):
        total = dr.fma(term, weight, total)
    return total


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


def within(qx: Float, qy: Float, radii: tuple[float, float]) -> Mask:
    """Whether frequencies lie in an ellipse, to rounding in single precision."""
    return dr.square(qx * (1.0 / radii[0])) + dr.square(qy * (1.0 / radii[1])) <= 1.0 + 2e-6


class DeviceTable:
    """A table's coefficients in the memory of the current variant, and how to look them up."""

    def __init__(self, table: DiffractionTable) -> None:
        self.expansion, self.grid = table.expansion, table.grid
        self.spacing, self.radii = table.spacing, table.q_max
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

        qx, qy, kappa : mi.Float, rad/µm. Outside the table the result is NaN, never a guess.
        windows : where they are; none for that of the table itself.
        """
        grid, expansion = self.grid, self.expansion
        inside = within(qx, qy, self.radii) & (kappa <= expansion.kappa_max * (1 + 1e-6))
        interval, weights, centre = self.series.at(kappa)

        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        first, weight_x, weight_y = self._place(x, y, interval)
        weights_x = [weight_x(n) for n in range(grid.taps[0])]

        lobe_x, lobe_y = grid.order_0_exponents
        lobe = dr.exp2(dr.fma(_log2(lobe_x), dr.square(x), _log2(lobe_y) * dr.square(y)))

        if windows:
            total = self._over_windows(first, (x, y), weights_x, weight_y, weights, windows)
            parts = [
                dr.fma(lobe, c, part * self._inverse_scale)
                for c, part in zip(centre, total, strict=True)
            ]
            result = dr.square(parts[0]) + dr.square(parts[1])
        elif self.record.components == 2 and not grid.coherent:
            total = self._over_taps(
                first, weights_x, weight_y, lambda packets: self._squares(packets, weights)
            )[0]
            power = sum((dr.square(c) for c in centre), mi.Float(0.0))
            result = dr.fma(lobe, power, total * self._inverse_scale**2)
        else:
            packets = self._over_taps(first, weights_x, weight_y, lambda packets: packets)
            parts = [
                dr.fma(lobe, c, inner(part, weights) * self._inverse_scale)
                for c, part in zip(centre, self._components(packets), strict=True)
            ]
            if grid.coherent:
                result = dr.square(parts[0]) + dr.square(parts[1])
            else:
                result = dr.maximum(parts[0], 0.0)  # a cut series may dip below zero by its error
        return dr.select(inside, result, dr.nan)

    def first_bin(self, qx: Float, qy: Float, kappa: Float) -> Index:
        """Index of the first bin that `window_sum` reads (for benchmarks)."""
        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        return self._place(x, y, self.series.at(kappa)[0])[0]

    def read(self, index: Index) -> list[Packet]:
        """All floats of the bin with this index, in packets."""
        return read_packets(self._coefficients, index, self.record.numbers)

    def order_0(self, kappa: Float) -> Float:
        """|a_0(κ)|², the power of order 0."""
        centre = self.series.at(kappa)[2]
        if self.record.components == 2:
            return dr.square(centre[0]) + dr.square(centre[1])
        return dr.maximum(centre[0], 0.0)

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
                found = of(self.read(start + i))
                if not total:
                    total = [p * weights_x[i] for p in found]
                else:
                    total = [dr.fma(p, weights_x[i], t) for p, t in zip(found, total, strict=True)]
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
            found = row_sum(first + j * columns_a_row, columns)
            if not total:
                total = [p * weight_y(j) for p in found]
            else:
                total = [dr.fma(p, weight_y(j), t) for p, t in zip(found, total, strict=True)]
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
                sums = [_turned(value, x[i], found) for x, found in zip(across, sums, strict=True)]
            for found, (cos, sin) in zip(sums, phases, strict=True):
                total = _turned(found, (cos * weight, sin * weight), total)
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

    looped : the function is to take variables, too.
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


def _summed(one: Rotation, other: Rotation) -> Rotation:
    """(cos, sin) of the sum of two angles, times what weights they have."""
    (x, y), (cos, sin) = one, other
    return dr.fma(x, cos, -y * sin), dr.fma(x, sin, y * cos)


def _along(step: Rotation, weights: list[Float]) -> list[Rotation]:
    """(cos, sin) of 0, 1, 2 … steps, times weights."""
    phase: Rotation = (mi.Float(1.0), mi.Float(0.0))
    found = []
    for weight in weights:
        found.append((phase[0] * weight, phase[1] * weight))
        phase = _summed(phase, step)
    return found


def _log2(exponent: float) -> float:
    """Factor of the exponent of 2 that makes exp(−exponent·Δ²)."""
    return -float(exponent) / math.log(2.0)
