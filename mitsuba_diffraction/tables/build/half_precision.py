"""Coefficients as half floats."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

_SUBNORMAL, _ROUNDS = np.float32(2.0**-14), np.float32(0.75)
_HALF_PEAK = 2.0**14  # largest stored half float: far from its overflow, the rest far from its zero


def half_scale(largest: float) -> float:
    """The power of two that half floats up to `largest` in size are multiplied with."""
    # Next to nothing is left unscaled: a factor beyond single precision's range helps nobody
    return 2.0 ** math.floor(math.log2(_HALF_PEAK / largest)) if largest > 1e-30 else 1.0


def half_precision(coefficients: NDArray[np.float32]) -> tuple[NDArray[np.float16], float]:
    """The coefficients as half floats, scaled so that the largest is far from overflow."""
    scale = half_scale(float(max(coefficients.max(), -coefficients.min())))
    halves = np.empty(coefficients.shape, np.float16)
    for interval in range(len(coefficients)):
        for row, half in zip(coefficients[interval], halves[interval], strict=True):
            row *= np.float32(scale)
            # The smallest half floats are multiples of 2⁻²⁴, and so is what this leaves of small
            # numbers; NumPy is twenty times slower where its conversion has to round them.
            np.subtract(row + _ROUNDS, _ROUNDS, out=row, where=np.abs(row) < _SUBNORMAL)
            half[...] = row
    return halves, scale
