"""Refraction into a coat, and what its face transmits."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.boundary import small_slope
from mitsuba_diffraction.optics.coat import refracted, transmitted
from mitsuba_diffraction.optics.fresnel import reflectance
from tests.directions import polar


def test_refraction_is_snell_s():
    for theta in (0.0, 30.0, 80.0):
        inside = refracted(polar(theta, 70.0), 1.5)
        assert np.linalg.norm(inside) == pytest.approx(1.0, abs=1e-12)
        assert 1.5 * np.hypot(*inside[:2]) == pytest.approx(np.sin(np.radians(theta)), abs=1e-12)


@pytest.mark.parametrize("theta", [0.0, 40.0, 80.0])
def test_both_polarisations_together_are_what_is_not_reflected(theta):
    wi = polar(theta)
    # a structure that changes nothing, light coming and going at one angle
    through = transmitted(np.eye(2), wi, wi, 1.58)
    assert np.mean(np.abs(np.diag(through))) == pytest.approx(
        1.0 - reflectance(np.cos(np.radians(theta)), 1.58), abs=1e-12
    )


def test_it_is_reciprocal():
    wi, wo = polar(60.0, 10.0), polar(30.0, 130.0)
    below, above = refracted(wi, 1.5), refracted(wo, 1.5)
    there = transmitted(small_slope(below, above, 0.6 + 4j), wi, wo, 1.5)
    back = transmitted(small_slope(above, below, 0.6 + 4j), wo, wi, 1.5)
    signs = np.array([[1.0, -1.0], [-1.0, 1.0]])  # reversed light has the other p
    assert there == pytest.approx(signs * back.T, abs=1e-12)
