"""The second order of small slope: its coefficients, and what they multiply."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.second_order import (
    Perturbation,
    factor,
    interpolated,
    obliqueness,
    slope_coefficients,
)
from mitsuba_diffraction.reference import boundary
from tests.support.directions import polar

KERATIN = 1.56


@pytest.mark.parametrize("index", [KERATIN, 1 / KERATIN])
def test_coefficients_are_reciprocal_and_even_in_the_azimuth(index):
    first, second = polar(50.0, 20.0), polar(25.0, 140.0)
    there = slope_coefficients(first, second[None], index)
    assert slope_coefficients(second, first[None], index) == pytest.approx(there, abs=1e-12)
    mirrored = polar(50.0, -20.0), polar(25.0, -140.0)
    even = slope_coefficients(mirrored[0], mirrored[1][None], index)
    assert even == pytest.approx(there, abs=1e-12)


def test_across_and_along_are_one_where_light_keeps_its_direction():
    wi = polar(1e-4, 0.0)
    along_x, across = slope_coefficients(wi, np.array([[0.0, 0.0, 1.0]]), KERATIN)[0]
    assert along_x == pytest.approx(across, rel=1e-3)


def test_without_contrast_there_is_nothing():
    assert slope_coefficients(polar(50.0), polar(25.0, 140.0)[None], 1.0) == pytest.approx(0.0)


def test_the_first_order_is_the_boundary_s():
    wi, wo = polar(50.0, 20.0), np.array([polar(25.0, 140.0), polar(70.0, -30.0)])
    found = Perturbation(wi, KERATIN).first(wo[:, :2])
    exact = boundary.unpolarised(boundary.small_slope(wi, wo, KERATIN))
    assert boundary.unpolarised(found) == pytest.approx(exact, rel=1e-9)


def test_a_table_finds_the_coefficients():
    rng = np.random.default_rng(3)
    errors, lengths = [], []
    for theta in rng.uniform(0.0, 85.0, 20):
        wi = polar(theta, 180.0)
        wo = np.array([polar(*rng.uniform([0.0, -180.0], [80.0, 180.0])) for _ in range(12)])
        exact = slope_coefficients(wi, wo, KERATIN)
        errors.append(np.abs(interpolated(KERATIN, wi, wo) - exact).sum(axis=1))
        lengths.append(np.hypot(*(wi + wo)[:, :2].T))
    # |c| is 0.6 at the median; beside the mirror direction along and across turn quickly
    assert np.median(errors) < 0.02
    assert np.max(np.concatenate(errors)[np.concatenate(lengths) > 0.2]) < 0.2


def test_power_grows_to_2_25_at_most():
    ratios = np.array([[0.1 + 0.2j, 0.0], [300.0, 200j]])
    found = factor(np.ones((2, 2)), ratios, 1.0)
    assert found[0] == pytest.approx(1.1**2 + 0.2**2)
    assert found[1] <= 2.25 + 1e-12
    assert factor(np.ones((2, 2)), ratios, 0.0) == pytest.approx(1.0)


def test_it_fades_towards_the_normal_and_not_in_oblique_light():
    cosines = np.cos(np.radians([0.0, 20.0, 45.0, 60.0, 89.0]))
    faded = obliqueness(cosines[:, None], cosines)
    assert faded[0, 0] == 0.0
    assert np.all(np.diff(faded, axis=0) >= 0.0)  # the steeper, the less
    assert np.array_equal(faded, faded.T)
    assert faded[2:, 2:] == pytest.approx(1.0)
