"""Reading a table in scalar variants: one look-up at a time, without Dr.Jit.

Dr.Jit gathers nothing in scalar variants, and `tables.lookup` is made for long arrays: a call for
one number would take thirty times as long. What is summed is said there.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from ..tables.table import DiffractionTable
from ..tables.window import first_tap


class ScalarTable:
    """The look-ups of `plugin.lookup.DeviceTable` for plain numbers."""

    def __init__(self, table: DiffractionTable) -> None:
        # A copy: whoever keeps this by its table must not keep that table alive
        self._table = dataclasses.replace(table)
        grid = table.grid
        self._read = np.ones(grid.taps[::-1], np.float32)  # 0 for taps left out
        for row, trim in enumerate(grid.trims):
            self._read[row, :trim] = self._read[row, grid.taps[0] - trim :] = 0.0

    def window_sum(self, qx: float, qy: float, kappa: float) -> float:
        """Σ over orders under the window; NaN outside the table."""
        table = self._table
        grid, expansion = table.grid, table.expansion
        if not table.covers(qx, qy, kappa):
            return math.nan
        interval, weights = self._series(kappa)
        x, y = qx / table.spacing[0], qy / table.spacing[1]
        column, weights_x = _taps(x, grid.last[0], grid.taps[0], grid.exponents[0])
        row, weights_y = _taps(y, grid.last[1], grid.taps[1], grid.exponents[1])
        window = weights_y[:, None] * weights_x * self._read
        bins = table.coefficients[
            interval, row : row + grid.taps[1], column : column + grid.taps[0]
        ]
        values = bins.astype(np.float32) @ (weights / np.float32(table.scale))
        centre = table.centre(kappa).astype(np.float32)
        lobe_x, lobe_y = grid.order_0_exponents
        lobe = math.exp(-lobe_x * x * x - lobe_y * y * y)
        if expansion.kind == "amplitude" and not grid.coherent:
            power = (values * values).sum(axis=2)
            return float((window * power).sum() + lobe * (centre @ centre))
        total = np.tensordot(window, values, 2) + centre * lobe
        return float(total @ total) if grid.coherent else max(float(total[0]), 0.0)

    def order_0(self, kappa: float) -> float:
        """|a_0(κ)|², the power of order 0."""
        centre = self._table.centre(kappa)
        return float(centre @ centre) if len(centre) == 2 else max(float(centre[0]), 0.0)

    def _series(self, kappa: float) -> tuple[int, NDArray[np.float32]]:
        expansion = self._table.expansion
        weights = expansion.weights(np.float64(kappa)).astype(np.float32)
        return int(expansion.interval(kappa)), weights


def _taps(
    position: float, last: int, taps: int, exponent: float
) -> tuple[int, NDArray[np.float32]]:
    """Array index of the first tap, and all weights."""
    base = math.floor(position if taps % 2 == 0 else position + 0.5)
    first = base + first_tap(taps)
    # Frequencies beyond the bins see the zeros at the margin, which is as wide as the taps
    index = min(max(first + last, 0), 2 * last + 1 - taps)
    distance = (position - first) - np.arange(taps)
    return index, np.exp(-exponent * distance**2).astype(np.float32)
