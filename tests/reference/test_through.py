"""Jones matrices of light that goes through: limits, and one model beside the other."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.reference import boundary, fresnel, through
from tests.support.directions import polar
from tests.support.matrices import pairs

MATRICES = (through.small_slope, through.kirchhoff)
N = 1.5


def refracted(wi: np.ndarray) -> np.ndarray:
    """Where the flat interface sends light along −ωi."""
    tangential = -wi[:, :2] / N
    return np.column_stack([tangential, -np.sqrt(1 - np.sum(tangential**2, axis=1))])


@pytest.mark.parametrize("matrix", MATRICES)
def test_in_the_refracted_direction_it_is_fresnel_s(matrix):
    wi, _ = pairs()
    wo = refracted(wi)
    cos_i, cos_t = wi[:, 2], -wo[:, 2]
    t_s, t_p = 2 * cos_i / (cos_i + N * cos_t), 2 * cos_i / (N * cos_i + cos_t)
    scale = (N * cos_t - cos_i) / (2 * cos_i)
    expected = np.stack([t_s, 0 * t_s, 0 * t_s, t_p], -1).reshape(-1, 2, 2)
    assert matrix(wi, wo, N) == pytest.approx(scale[:, None, None] * expected, abs=1e-13)


def test_near_the_refracted_direction_both_agree_cross_terms_included():
    wi, _ = pairs()
    wi = wi[wi[:, 2] > 0.3]
    aside = np.random.default_rng(5).normal(size=wi.shape)
    differences = []
    for step in (1e-3, 1e-4):
        wo = refracted(wi) + step * aside
        wo /= np.linalg.norm(wo, axis=1, keepdims=True)
        both = [matrix(wi, wo, N) for matrix in MATRICES]
        differences.append(np.abs(both[0] - both[1]).max())
        assert np.abs(both[0][:, 0, 1]).max() > 0.01 * step  # there is something to compare
    assert differences[1] < 0.015 * differences[0]  # quadratic: 0.01, and a little of the cubic


def test_it_is_continuous_at_the_critical_angle():
    inside = np.degrees(np.arcsin(1 / N))
    wi = polar(40.0, 20.0)
    below, beyond = (
        boundary.unpolarised(through.small_slope(wi, polar(inside + d, 150.0) * [1, 1, -1], N))
        for d in (-1e-6, 1e-6)
    )
    assert below == pytest.approx(float(beyond), rel=1e-3)  # as the root of the step


@pytest.mark.parametrize("theta", [0.0, 50.0, 80.0])
def test_a_flat_sheet_lets_through_what_two_mirrors_do(theta):
    wi = polar(theta, 30.0)
    cos_t = np.sqrt(1 - (1 - wi[2] ** 2) / N**2)
    t_s, t_p = 2 * wi[2] / (wi[2] + N * cos_t), 2 * wi[2] / (N * wi[2] + cos_t)
    found = through.out_of_sheet(np.diag([t_s, t_p]), wi, -wi, N)
    powers = np.abs(np.diag(found)) ** 2 * N * cos_t / wi[2]
    single = np.abs(np.stack(fresnel.amplitudes(wi[2], N))) ** 2
    assert powers == pytest.approx((1 - single) / (1 + single), rel=1e-12)
