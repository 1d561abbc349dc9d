"""A mirror's lobe at the horizon, by the fit to C of equation (11) in `optics.mirror`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Real
from ..optics import mirror
from ..optics.geometry import wavenumber


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
