"""Where a table's numbers lie: what NumPy, the plugin and the shaders all read.

Coefficients are an array (intervals, rows, columns, components, terms). Bin (0, 0), the zeroth
order, is in the middle of (rows, columns), and zero; its series is kept apart (`order_0`). A
renderer reads the numbers of one bin as a record: one component after the other, the terms of each
filled up with zeros (`BinRecord`). Functions of κ are sampled on equal cells of every interval,
without the factor they fade with as κ → 0 (`cells_of`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .expansion import Expansion

#: Smaller half floats, which are subnormal, are stored as 0: kernels read them as 0, NumPy is slow.
LEAST_HALF = 2.0**-14
#: Distance of bins, in 1/σ, at which amplitudes of neighbouring lobes overlap by exp(−9).
_APART = 6.0


@dataclass(frozen=True)
class Grid:
    """The bins of a table and the window around them.

    Attributes
    ----------
    last : (jx, jy), outermost bins stored.
    steps : (σ·dqx, σ·dqy), bin spacing in units of 1/σ.
    radius : in bins (x, y), the frequencies that the table is for.
    taps : (x, y) bins read by a look-up.
    coherent : amplitudes are added (`patch`) instead of powers.
    trims : taps left out at both ends of each row, one number a row; empty if none are.
    """

    last: tuple[int, int]
    steps: tuple[float, float]
    radius: tuple[float, float]
    taps: tuple[int, int]
    coherent: bool
    trims: tuple[int, ...] = ()

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns) of bins."""
        return 2 * self.last[1] + 1, 2 * self.last[0] + 1

    @property
    def middle(self) -> tuple[int, int]:
        """(row, column) of order 0."""
        return self.last[1], self.last[0]

    def index(self, interval: Any, row: Any, column: Any) -> Any:
        """Number of a bin's record, counted over intervals, rows and columns."""
        rows, columns = self.shape
        return (interval * rows + row) * columns + column

    def tapped(self) -> list[range]:
        """Columns that a look-up reads, of every row of taps."""
        columns, rows = self.taps
        return [range(trim, columns - trim) for trim in self.trims or (0,) * rows]

    @property
    def overlapping(self) -> bool:
        """Whether lobes of neighbouring orders overlap, and interfere, under one window."""
        return self.coherent and min(self.steps) < _APART

    @property
    def taps_read(self) -> int:
        """Bins that one look-up reads."""
        return sum(map(len, self.tapped()))

    @property
    def exponents(self) -> tuple[float, float]:
        """Exponents of exp(−exponent·Δ²), the weight of a bin Δ bins away, along x and y."""
        half = 0.5 if self.coherent else 1.0
        return half * self.steps[0] ** 2, half * self.steps[1] ** 2


@dataclass(frozen=True)
class BinRecord:
    """The numbers of one bin in one interval, as renderers store them.

    Attributes
    ----------
    components, terms : of the table.
    stored : terms with the zeros that fill them up.
    """

    components: int
    terms: int
    stored: int

    @classmethod
    def of(cls, components: int, terms: int, unit: int = 1) -> BinRecord:
        """Terms filled up to a multiple of `unit`."""
        return cls(components, terms, -(-terms // unit) * unit)

    @classmethod
    def aligned(cls, components: int, terms: int) -> BinRecord:
        """Fill up as processors gather best: 1, 2, or a multiple of 4 terms, of 8 from 17 on."""
        return cls.of(components, terms, 1 if terms <= 2 else 4 if terms <= 16 else 8)

    @property
    def numbers(self) -> int:
        """Number of numbers in the record."""
        return self.components * self.stored

    def split(self, numbers: Sequence[Any]) -> list[Sequence[Any]]:
        """The stored terms of each component, out of a record's numbers."""
        return [numbers[n * self.stored : (n + 1) * self.stored] for n in range(self.components)]

    def pack(self, coefficients: NDArray[Any]) -> NDArray[Any]:
        """Coefficients (…, components, terms) as records (n, numbers)."""
        missing = [(0, 0)] * (coefficients.ndim - 1) + [(0, self.stored - self.terms)]
        return np.pad(coefficients, missing).reshape(-1, self.numbers)


def cells_of(expansion: Expansion, phase: float) -> int:
    """Equal cells of an interval of κ across which the phase of the heights changes this much.

    phase : rad, at most.
    """
    return max(8, math.ceil(2.0 * expansion.half_range * expansion.length / phase))


def functions_at(expansion: Expansion, kappa: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the factors of the terms, κ.shape + (terms,), without that of κ̂ or κ̂²."""
    return np.asarray(expansion.weights(kappa) / expansion.fading(kappa)[..., None])
