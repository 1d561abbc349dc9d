"""One try at a table: its coefficients, and the error that they leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...heights.field import HeightField
from ...progress import Progress
from ..expansion import Expansion
from ..packing import Grid
from ..window import FULL_REACH
from .checks import check_size
from .coefficients import coefficients_of
from .error import FLOOR, ErrorMeter, Parts, worst
from .half_precision import half_precision
from .powers import Spectra

#: Below it single precision transforms would spend a share of the tolerance themselves.
DOUBLE_BELOW = 2e-4


class Attempt:
    """A table with one setting, and its error.

    Parameters
    ----------
    patches, grid, expansion : what is tabulated, where, and in which series.
    functions : how many functions of basis "svd" the Chebyshev series is made into, if it is.
    half : store half floats.
    tolerance : of the table; the finest take transforms in double precision.
    tell : called as tell(done, total, text).

    Attributes
    ----------
    coefficients, order_0, scale, expansion, grid : of the table.
    measured : the error last measured, see `tables.build.error.worst`.
    """

    def __init__(
        self,
        patches: Sequence[HeightField],
        grid: Grid,
        expansion: Expansion,
        functions: int | None,
        half: bool,
        tolerance: float,
        tell: Progress,
    ) -> None:
        check_size(grid, expansion, functions)
        double = expansion.basis == "taylor" or tolerance < DOUBLE_BELOW
        margin = math.ceil(FULL_REACH * math.sqrt(2.0) / min(grid.steps)) + 2
        outer = (grid.last[0] + margin, grid.last[1] + margin)
        self._tick = _Ticks(tell)
        self._spectra = Spectra(patches, outer, double, self._tick)
        self._checks = [expansion.extrema(interval) for interval in range(expansion.intervals)]
        transforms = expansion.intervals * expansion.series_terms * self._spectra.count
        self._tick.transforms = transforms
        self._tick.total = transforms + sum(map(len, self._checks)) * self._spectra.count
        self.grid = grid
        self.measured: dict[str, float] = {}
        self._parts: list[Parts] = []
        self._trims: tuple[int, ...] | None = None
        self.coefficients: NDArray[Any]
        self.coefficients, self.order_0, self.expansion = coefficients_of(
            self._spectra, grid, expansion, functions
        )
        self.scale = 1.0
        if half:
            self.coefficients, self.scale = half_precision(self.coefficients)

    def error(self, trims: tuple[int, ...] = ()) -> float:
        """The larger of both errors, with some taps left out."""
        if trims != self._trims:
            self._meter = ErrorMeter(self._spectra, replace(self.grid, trims=trims), self.expansion)
            self._parts, self._tick.done = [], self._tick.transforms
            for values, centre, kappas in zip(
                self.coefficients, self.order_0, self._checks, strict=True
            ):
                self._parts += self._meter.series(values, centre, kappas, self.scale)
            self.measured = worst(np.concatenate(self._checks).tolist(), self._parts)
            self._trims = trims
        return max(self.measured["near"], self.measured["far"])

    def taps_error(self) -> float:
        """The taps' own share of the error where it was worst."""
        floor = FLOOR * np.array(self._parts)[:, 1].max(axis=0)
        shares = []
        for n, name in enumerate(("near", "far")):
            alone = self._meter.taps_alone(self.measured[f"kappa_{name}"])
            shares.append(float(alone[0, n] / max(alone[1, n], floor[n], 1e-30)))
        return max(shares)


class _Ticks:
    """Tells of transforms; apart from the attempt, or that would keep its arrays in a cycle."""

    def __init__(self, tell: Progress) -> None:
        self._tell = tell
        self.done = self.transforms = self.total = 0

    def __call__(self) -> None:
        self.done = min(self.done + 1, self.total)
        text = "transforming" if self.done <= self.transforms else "measuring the error"
        self._tell(self.done, self.total, text)
