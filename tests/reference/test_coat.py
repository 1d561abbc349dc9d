"""Refraction into a coat, and what its face transmits."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.reference.coat import refracted, transmitted
from mitsuba_diffraction.reference.fresnel import amplitudes
from mitsuba_diffraction.reference.model import small_slope
from tests.support.directions import polar


def test_refraction_is_snell_s():
    for theta in (0.0, 30.0, 80.0):
        inside = refracted(polar(theta, 70.0), 1.5)
        assert np.linalg.norm(inside) == pytest.approx(1.0, abs=1e-12)
        assert 1.5 * np.hypot(*inside[:2]) == pytest.approx(np.sin(np.radians(theta)), abs=1e-12)


@pytest.mark.parametrize("index", [0.6 + 4j, 1.3, 2.0])
@pytest.mark.parametrize("theta", [0.0, 40.0, 80.0])
def test_both_mirrors_reflect_what_their_bounces_add_up_to(theta, index):
    wi = polar(theta)
    inside = refracted(wi, 1.58)[2]
    found = transmitted(np.diag(amplitudes(inside, index)), wi, wi * [-1, -1, 1], 1.58, index)
    for n in range(2):
        face = np.abs(amplitudes(wi[2], 1.58)[n]) ** 2
        structure = np.abs(amplitudes(inside, index)[n]) ** 2
        series = sum((1 - face) ** 2 * structure * (face * structure) ** m for m in range(200))
        assert np.abs(found[n, n]) ** 2 == pytest.approx(series, rel=1e-9)


@pytest.mark.parametrize("index", [0.05 + 4j, 0.6 + 4j])
def test_no_light_is_gained_whatever_the_structure_does_with_it(index):
    angles = np.linspace(0.0, 89.9, 60)
    wi, wo = np.meshgrid(angles, angles)
    wi, wo = polar(wi.ravel()).T, polar(wo.ravel()).T
    # all that a mirror would reflect of either polarisation goes to ωo
    mirror = np.abs(np.stack(amplitudes(refracted(wi, 1.58)[:, 2], index))) ** 2
    most = np.abs(transmitted(np.ones((len(wi), 2, 2)), wi, wo, 1.58, index)) ** 2
    face = np.abs(np.stack(amplitudes(wi[:, 2], 1.58))) ** 2
    for out in range(2):
        for into in range(2):
            assert np.all(face[into] + most[:, out, into] * mirror[into] < 1.0 + 1e-9)


def test_it_is_reciprocal():
    wi, wo = polar(60.0, 10.0), polar(30.0, 130.0)
    below, above = refracted(wi, 1.5), refracted(wo, 1.5)
    there = transmitted(small_slope(below, above, 0.6 + 4j), wi, wo, 1.5, 0.6 + 4j)
    back = transmitted(small_slope(above, below, 0.6 + 4j), wo, wi, 1.5, 0.6 + 4j)
    signs = np.array([[1.0, -1.0], [-1.0, 1.0]])  # reversed light has the other p
    assert there == pytest.approx(signs * back.T, abs=1e-12)
