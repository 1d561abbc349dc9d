"""Correction C of a mirror's lobe at the horizon, by its equation: the judge of `optics.mirror`.

C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) e^{−βY/2} C(Y) = e^{−βX/2}
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..optics.fresnel import Filmed, Index
from ..optics.geometry import wavenumber
from .fresnel import reflectance

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: X where the reflectance is compared with that at the horizon, and the largest β.
SLOPE_AT, MOST_SLOPE = 1.25, 2.4
# Nodes of X up to _REACH, beyond which C is 1; values of β; steps of the iteration
_NODES, _REACH, _SLOPES, _STEPS = 600, 8.0, 25, 100


@cache
def solution() -> tuple[Real, Real, Real]:
    """Return X (n,), β (m,) and C (m, n): the fixed point, by the geometric mean of two steps."""
    x = (np.arange(_NODES) + 0.5) * _REACH / _NODES
    slopes = np.linspace(0.0, MOST_SLOPE, _SLOPES)
    kernel = np.exp(-((x[:, None] ** 2 - x**2) ** 2) / 4) / np.sqrt(np.pi) * x * _REACH / _NODES
    falls = np.exp(-0.5 * slopes[:, None] * x)
    c = np.ones_like(falls)
    inside = x < _REACH - 1.0  # the rest misses what lies beyond _REACH
    for _ in range(_STEPS):
        c = np.where(inside, np.sqrt(c * falls / ((falls * c) @ kernel.T)), 1.0)
    return x, slopes, c


def correction(cosine: Real, sharpness: Real, slope: Real) -> Real:
    """Return C of directions (n,) at X = sharpness · cosine, for slopes β."""
    x, slopes, c = solution()
    place = np.clip(np.asarray(slope) / (slopes[1] - slopes[0]), 0.0, len(slopes) - 1.001)
    low = place.astype(int)
    position = np.clip(sharpness * cosine / (x[1] - x[0]) - 0.5, 0.0, len(x) - 1.001)
    column = position.astype(int)
    s, t = place - low, position - column
    below, above = ((1 - t) * c[row, column] + t * c[row, column + 1] for row in (low, low + 1))
    return np.asarray((1 - s) * below + s * above)


def horizon_correction(light: Any, sigma: float, index: Index | None, bare: bool = True) -> Real:
    """Return C(X_i) C(X_o) of a window's σ (µm) for `model.Light`.

    index : of the mirror; None of a perfect reflector. β is 0 of total
        reflection, under films, and under a coat (bare=False).
    """
    sharpness = np.sqrt(wavenumber(light.wavelength) * sigma)
    slope = np.zeros_like(sharpness)
    if bare and index is not None and not isinstance(index, Filmed):
        there = reflectance(np.minimum(SLOPE_AT / sharpness, 1.0), index)
        falls = np.clip(-np.log(np.maximum(there, 1e-6)) / SLOPE_AT, 0.0, MOST_SLOPE)
        slope = np.where(np.abs(np.real(np.asarray(index) ** 2) - 0.5) < 0.5, 0.0, falls)
    at_i, at_o = (correction(w[:, 2], sharpness, slope) for w in (light.wi, light.wo))
    return at_i * at_o


def interfering(others: Real, mirror: Real, cosine: Real) -> Real:
    """Return the sum of f of all orders but 0 and of order 0, under one window.

    Mueller matrices add up as powers do, and have the interference of unpolarised light.

    cosine : (n,) of the phase between both; 0 in an ensemble.
    """
    a, b = (f if f.ndim == 1 else f[:, 0, 0] for f in (others, mirror))
    beats = 2.0 * cosine * np.sqrt(a * b) / np.maximum(a + b, 1e-300)
    return np.asarray(((others + mirror).T * (1.0 + beats)).T)
