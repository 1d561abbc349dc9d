"""DFT coefficients of the phase screen exp(iκh), cropped to the orders that light can reach."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...heights import HeightField

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
        mean, weighted by the tapers, and all others are of the rest, filled up with zeros to twice
        its length. None along an axis for no fading.
    threaded : whether a transform may use several threads.
    """

    def __init__(
        self,
        field: HeightField,
        last: tuple[int, int],
        double: bool = False,
        tapers: Tapers = (None, None),
        threaded: bool = True,
    ) -> None:
        self.real_type: Any = np.float64 if double else np.float32
        self.complex_type: Any = np.complex128 if double else np.complex64
        lowest, highest = float(field.heights.min()), float(field.heights.max())
        self.half_range = 0.5 * (highest - lowest)
        # in double precision, but without a copy in it
        self.heights = np.empty(field.shape, self.real_type)
        middle = 0.5 * (highest + lowest)
        np.subtract(field.heights, middle, out=self.heights, dtype=np.float64, casting="same_kind")
        self.last, self._tile, self._threaded = last, filled(field.shape, tapers), threaded
        self._columns = Crop(self._tile[1], last[0])
        self._rows = Crop(self._tile[0], last[1])
        # of mean square 1 over the tile, so that powers add up to the screen's (Parseval)
        self._tapers = [
            (np.ones(n) if taper is None else taper * np.sqrt(tile / n)).astype(self.real_type)
            for n, taper, tile in zip(field.shape, tapers, self._tile, strict=True)
        ]

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
        result = np.zeros(self.shape, self.complex_type)
        faded, mean = (None, 0.0) if self._tile == self.heights.shape else self._faded(function)

        def along_x(start: int) -> None:
            rows = slice(start, start + _ROWS)
            block = function(self.heights[rows]) if faded is None else faded[rows]
            block = block.astype(self.complex_type, copy=False)
            lines = scipy.fft.ifft(block, self._tile[1], axis=1, overwrite_x=True)
            half[rows] = lines[:, self._columns.source]

        def along_y(start: int) -> None:
            block = np.ascontiguousarray(half[:, start : start + _ROWS].T)
            lines = scipy.fft.ifft(block, self._tile[0], axis=1, overwrite_x=True)
            wanted = lines[:, self._rows.source].T
            columns = self._columns.target[start : start + _ROWS]
            result[self._rows.target[0] : self._rows.target[-1] + 1, columns] = wanted

        blocks = range(0, ny, _ROWS), range(0, half.shape[1], _ROWS)
        # threads would take longer to start
        alone = not self._threaded or self.heights.size < _SMALL
        with nullcontext() if alone else ThreadPoolExecutor(os.cpu_count()) as pool:
            for work, starts in zip((along_x, along_y), blocks, strict=True):
                list((pool.map if pool else map)(work, starts))
        if faded is not None:
            result[self.last[1], self.last[0]] = mean
        return result

    def _faded(
        self, function: Callable[[NDArray[Any]], NDArray[Any]]
    ) -> tuple[NDArray[np.complexfloating], complex]:
        """Return c·w·(f − a), and a = Σ w² f / Σ w².

        With this mean |a|² and the powers of w·(f − a) add up to the mean of |f|² under w². In bin
        0 a replaces what is left, which c makes up for.
        """
        y, x = self._tapers
        values = function(self.heights).astype(self.complex_type, copy=False)
        # in double precision: orders are small beside a mean of nearly 1
        wide_y, wide_x = (np.square(taper, dtype=np.float64) for taper in (y, x))
        mean = complex(wide_y @ (values @ wide_x)) / float(wide_y.sum() * wide_x.sum())
        values -= self.complex_type(mean)
        values *= y[:, None]
        values *= x
        points = math.prod(self._tile)
        power = float(np.vdot(values, values).real) / points
        left = abs(complex(values.sum(dtype=np.complex128)) / points) ** 2
        if power > left:
            values *= self.real_type(math.sqrt(power / (power - left)))
        return values, mean


def filled(shape: tuple[int, int], tapers: Tapers) -> tuple[int, int]:
    """Return (ny, nx) of a screen of this shape with the zeros beyond its tapers."""
    y, x = (n if taper is None else 2 * n for n, taper in zip(shape, tapers, strict=True))
    return y, x


class Crop:
    """Which DFT bins of n are wanted, and where they go in an array of bins −last … last."""

    def __init__(self, n: int, last: int) -> None:
        self.bins = np.arange(max(-last, -(n // 2)), min(last, (n - 1) // 2) + 1)
        self.source = self.bins % n
        self.target = self.bins + last
