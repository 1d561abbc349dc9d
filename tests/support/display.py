"""Light to show by a view, and the difference between two ways to show it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.optics.colour import delta_e, linear_srgb, response


def ramp() -> NDArray[np.float32]:
    """Spectral colours and random ones over 31 stops, linear sRGB (93, 128, 3)."""
    lines = linear_srgb(response(np.linspace(390.0, 720.0, 128))) * 100.0
    noise = np.random.default_rng(2).normal(0.3, 0.7, (31, 128, 3))
    stops = 2.0 ** np.arange(-15.0, 16.0)[:, None, None]
    return np.concatenate([stops * lines, noise, stops * noise]).astype(np.float32)


def largest_difference(expected: NDArray[np.floating], drawn: NDArray[np.floating]) -> float:
    """ΔE2000 between two pictures in sRGB that differ most."""
    linear = [
        np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
        for c in (expected.astype(float), drawn.astype(float))
    ]
    return float(delta_e(*linear, exposure=1.0, least=0.0).max())
