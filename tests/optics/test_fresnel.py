"""Fresnel's reflectance in NumPy: known values, and Mitsuba's own."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.reference import fresnel

COSINES = np.cos(np.radians([0.0, 20.0, 45.0, 70.0, 89.0]))


@pytest.mark.parametrize("index", [1.5, 1.0 + 6.8j, 0.05 + 4.2j])
def test_at_normal_incidence(index):
    expected = abs((index - 1) / (index + 1)) ** 2
    assert fresnel.reflectance(1.0, index) == pytest.approx(expected, rel=1e-14)  # rounding


def test_at_brewster_s_angle_only_te_is_reflected():
    n = 1.5
    cosine = 1 / np.sqrt(1 + n * n)
    te = ((n * n - 1) / (n * n + 1)) ** 2
    assert fresnel.reflectance(cosine, n) == pytest.approx(0.5 * te, rel=1e-12)  # rounding


def test_a_perfect_conductor_reflects_everything():
    assert np.all(fresnel.reflectance(COSINES, np.inf) == 1.0)


def test_it_is_what_mitsuba_computes(some_variant):
    import mitsuba as mi

    cosine = COSINES.astype(np.float32)
    for index in (1.56, 1.004 + 6.807j, 0.6 + 2.0j):
        n = complex(index)
        if n.imag == 0:
            theirs = [mi.fresnel(mi.Float(float(c)), n.real)[0] for c in cosine]
        else:
            theirs = [mi.fresnel_conductor(mi.Float(float(c)), mi.Complex2f(n.real, n.imag))
                      for c in cosine]  # fmt: skip
        values = np.array([np.array(value).item() for value in theirs])
        # Mitsuba's single precision
        assert fresnel.reflectance(cosine, n) == pytest.approx(values, abs=2e-6)
