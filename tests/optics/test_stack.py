"""Stacks: the mean over a spread of thicknesses, and its phase."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from mitsuba_diffraction.optics import stack


def test_a_mean_over_a_spread_is_the_integral_over_a_gaussian_of_thicknesses():
    cosine, lam, spread = np.array([0.3, 0.9]), np.array([450.0, 640.0]), 0.1
    indices = np.array([[0.9 + 6.0j] * 2, [1.5] * 2, [2.3 + 0.01j] * 2, [1.4] * 2])
    thicknesses = np.array([90.0, 60.0, 110.0])
    found = stack.mean_powers(cosine, lam, indices, thicknesses, spread)
    places = np.linspace(-5.0, 5.0, 101)
    weights = np.exp(-0.5 * places**2) / np.exp(-0.5 * places**2).sum()
    expected = np.zeros_like(found)
    for place, weight in zip(places, weights, strict=True):
        s, p = stack.amplitudes(cosine, lam, indices, (1.0 + spread * place) * thicknesses)
        expected += weight * np.stack([np.abs(s) ** 2, np.abs(p) ** 2, p * s.conj()], axis=-1)
    assert np.abs(expected[..., 2].imag).min() > 0.01
    # the mean ends at three standard deviations
    assert_allclose(found, expected, atol=3e-3)
