"""DFT coefficients of the phase screen exp(iκh), cropped to the orders that light can reach."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...heights.field import HeightField

#: What fades at the edges, along y and x.
Tapers = tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]

#: Radius of the bins counted as the glossy reflection, in units of 1/σ.
GLOSSY_RADIUS = 3.0

_SMALL = 1 << 16  # pixels
_ROWS = 64  # rows (or columns) a task: large enough for the FFT, small enough to stay in cache


class Spectrum:
    """a_j = mean over pixels of f(h)·exp(i q_j·r), for |j| up to `last` in each direction.

    Bins beyond the patch's Nyquist frequency are 0: a sampled surface says nothing there.

    Parameters
    ----------
    field : the heights; they are centred here (half range ±H/2), which only turns phases.
    last : (jx, jy), the outermost bins wanted.
    double : compute in double precision instead of single.
    tapers : along y and x, of mean square 1, what f without its mean fades with: bin 0 is then the
        mean, and all others are of the rest. None along an axis, or altogether, for no fading.
    """

    def __init__(
        self,
        field: HeightField,
        last: tuple[int, int],
        double: bool = False,
        tapers: Tapers = (None, None),
    ) -> None:
        self.real_type: Any = np.float64 if double else np.float32
        self.complex_type: Any = np.complex128 if double else np.complex64
        lowest, highest = float(field.heights.min()), float(field.heights.max())
        self.half_range = 0.5 * (highest - lowest)
        # in double precision, but without a copy in it
        self.heights = np.empty(field.shape, self.real_type)
        middle = 0.5 * (highest + lowest)
        np.subtract(field.heights, middle, out=self.heights, dtype=np.float64, casting="same_kind")
        self.last = last
        self._columns = _Crop(self.heights.shape[1], last[0])
        self._rows = _Crop(self.heights.shape[0], last[1])
        self._tapers = None if tapers[0] is None and tapers[1] is None else self._filled(tapers)

    @property
    def shape(self) -> tuple[int, int]:
        """Bins (ny, nx) of every result; bin (0, 0) is in the middle."""
        return 2 * self.last[1] + 1, 2 * self.last[0] + 1

    def of_phase(self, kappa: float, minus_one: bool = False) -> NDArray[np.complexfloating]:
        """DFT of exp(iκh), or of exp(iκh) − 1, which keeps its precision as κ → 0."""

        def screen(heights: NDArray[np.floating]) -> NDArray[np.complexfloating]:
            phase = heights * self.real_type(kappa)
            out = np.empty(phase.shape, self.complex_type)
            np.sin(phase, out=out.imag)
            if minus_one:
                phase *= self.real_type(0.5)
                np.sin(phase, out=phase)
                np.multiply(phase, phase, out=phase)
                np.multiply(phase, self.real_type(-2.0), out=out.real)
            else:
                np.cos(phase, out=out.real)
            return out

        return self.of(screen)

    def of(self, function: Callable[[NDArray[Any]], NDArray[Any]]) -> NDArray[np.complexfloating]:
        """DFT of function(h), which is applied to blocks of rows of the centred heights (µm)."""
        ny = self.heights.shape[0]
        half = np.empty((ny, len(self._columns.bins)), self.complex_type)
        sums = np.zeros(-(-ny // _ROWS), np.complex128)
        result = np.zeros(self.shape, self.complex_type)

        def along_x(start: int) -> None:
            block = function(self.heights[start : start + _ROWS]).astype(
                self.complex_type, copy=False
            )
            if self._tapers is not None:
                sums[start // _ROWS] = block.sum(dtype=np.complex128)
                block *= self._tapers[0][start : start + _ROWS, None]
                block *= self._tapers[1]
            lines = scipy.fft.ifft(block, axis=1, overwrite_x=True)
            half[start : start + _ROWS] = lines[:, self._columns.source]

        def along_y(start: int) -> None:
            block = np.ascontiguousarray(half[:, start : start + _ROWS].T)
            lines = scipy.fft.ifft(block, axis=1, overwrite_x=True)
            wanted = lines[:, self._rows.source].T
            columns = self._columns.target[start : start + _ROWS]
            result[self._rows.target[0] : self._rows.target[-1] + 1, columns] = wanted

        blocks = range(0, ny, _ROWS), range(0, half.shape[1], _ROWS)
        small = self.heights.size < _SMALL  # threads would take longer to start
        with nullcontext() if small else ThreadPoolExecutor(os.cpu_count()) as pool:
            for work, starts in zip((along_x, along_y), blocks, strict=True):
                list((pool.map if pool else map)(work, starts))
        return self._mean_apart(result, sums)

    def _filled(self, tapers: Tapers) -> tuple[NDArray[Any], NDArray[Any]]:
        y, x = (
            np.ones(n) if taper is None else taper
            for n, taper in zip(self.heights.shape, tapers, strict=True)
        )
        return y.astype(self.real_type), x.astype(self.real_type)

    def _mean_apart(
        self, result: NDArray[np.complexfloating], sums: NDArray[np.complex128]
    ) -> NDArray[np.complexfloating]:
        """From the transform of w·f, that of w·(f − mean), with the mean in bin 0."""
        if self._tapers is None:
            return result
        mean = sums.sum() / self.heights.size
        y, x = (
            scipy.fft.ifft(taper.astype(np.float64))[crop.source]
            for taper, crop in zip(self._tapers, (self._rows, self._columns), strict=True)
        )
        rows, columns = self._rows.target, self._columns.target
        result[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] -= np.outer(mean * y, x)
        result[self.last[1], self.last[0]] = mean
        return result


class _Crop:
    """Which DFT bins of n are wanted, and where they go in an array of bins −last … last."""

    def __init__(self, n: int, last: int) -> None:
        self.bins = np.arange(max(-last, -(n // 2)), min(last, (n - 1) // 2) + 1)
        self.source = self.bins % n
        self.target = self.bins + last
