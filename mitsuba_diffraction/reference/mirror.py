"""A mirror's lobe at the horizon, and the equation of C, the judge of its fit in `optics.mirror`.

C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) C(Y) = 1.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ..arrays import Real
from ..optics import mirror
from ..optics.geometry import wavenumber

# Nodes of X up to _REACH, beyond which C is 1; steps of the iteration
_NODES, _REACH, _STEPS = 600, 8.0, 200


@cache
def solution() -> tuple[Real, Real]:
    """Return X and C, (n,): the fixed point, by the geometric mean of two steps."""
    x = (np.arange(_NODES) + 0.5) * _REACH / _NODES
    kernel = np.exp(-((x[:, None] ** 2 - x**2) ** 2) / 4) / np.sqrt(np.pi) * x * _REACH / _NODES
    inside = x < _REACH - 1.0  # the rest misses what lies beyond _REACH
    c = np.ones_like(x)
    for _ in range(_STEPS):
        c = np.where(inside, np.sqrt(c / (kernel @ c)), 1.0)
    return x, c


def horizon_correction(light: Any, sigma: float) -> Real:
    """Return C(X_i) C(X_o) of a window's σ (µm) for `model.Light`."""
    into, out = (sigma * w[:, 2] ** 2 for w in (light.wi, light.wo))
    return np.asarray(mirror.horizon_correction(into, out, wavenumber(light.wavelength)))


def mirror_cosine(light: Any, sigma: float) -> Real:
    """Return cosθm (n,) of `model.Light`."""
    half = 0.5 * np.linalg.norm(light.wi + light.wo, axis=1)
    sharpness = sigma * wavenumber(light.wavelength)
    return np.asarray(mirror.mirror_cosine(half, light.wi[:, 2], light.wo[:, 2], sharpness))


def interfering(others: Real, zeroth: Real, cosine: Real) -> Real:
    """Return the sum of f of all orders but 0 and of order 0, under one window.

    Mueller matrices add up as powers do, and have the interference of unpolarised light.

    cosine : (n,) of the phase between both; 0 in an ensemble.
    """
    a, b = (f if f.ndim == 1 else f[:, 0, 0] for f in (others, zeroth))
    beats = 2.0 * cosine * np.sqrt(a * b) / np.maximum(a + b, 1e-300)
    return np.asarray(((others + zeroth).T * (1.0 + beats)).T)
