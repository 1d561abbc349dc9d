"""What surrounds the model: light that goes through, coats, and mirrors at the horizon."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.mirror import horizon_correction
from mitsuba_diffraction.reference import boundary, fresnel, through
from mitsuba_diffraction.reference.coat import refracted, transmitted
from mitsuba_diffraction.reference.fresnel import amplitudes
from tests.support.directions import polar
from tests.support.matrices import pairs

MATRICES = (through.small_slope, through.kirchhoff)
N = 1.5


def passed(wi: np.ndarray) -> np.ndarray:
    """Where the flat interface sends light along −ωi."""
    tangential = -wi[:, :2] / N
    return np.column_stack([tangential, -np.sqrt(1 - np.sum(tangential**2, axis=1))])


@pytest.mark.parametrize("matrix", MATRICES)
def test_in_the_refracted_direction_it_is_fresnel_s(matrix):
    wi, _ = pairs()
    wo = passed(wi)
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
        wo = passed(wi) + step * aside
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


def test_refraction_into_a_coat_is_snell_s():
    for theta in (0.0, 30.0, 80.0):
        inside = refracted(polar(theta, 70.0), 1.5)
        assert np.linalg.norm(inside) == pytest.approx(1.0, abs=1e-12)
        assert 1.5 * np.hypot(*inside[:2]) == pytest.approx(np.sin(np.radians(theta)), abs=1e-12)


@pytest.mark.parametrize("index", [0.6 + 4j, 1.3, 2.0])
@pytest.mark.parametrize("theta", [0.0, 40.0, 80.0])
def test_a_coat_and_a_mirror_reflect_what_their_bounces_add_up_to(theta, index):
    wi = polar(theta)
    inside = refracted(wi, 1.58)[2]
    found = transmitted(np.diag(amplitudes(inside, index)), wi, wi * [-1, -1, 1], 1.58, index)
    for n in range(2):
        face = np.abs(amplitudes(wi[2], 1.58)[n]) ** 2
        structure = np.abs(amplitudes(inside, index)[n]) ** 2
        series = sum((1 - face) ** 2 * structure * (face * structure) ** m for m in range(200))
        assert np.abs(found[n, n]) ** 2 == pytest.approx(series, rel=1e-9)


@pytest.mark.parametrize("index", [0.05 + 4j, 0.6 + 4j])
def test_under_a_coat_no_light_is_gained_whatever_the_structure_does_with_it(index):
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


def test_the_fit_at_the_horizon_satisfies_its_equation():
    """C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) C(Y) = 1."""
    nodes, reach = 1600, 9.0
    x = (np.arange(nodes) + 0.5) * reach / nodes
    kernel = np.exp(-((x[:, None] ** 2 - x**2) ** 2) / 4) / np.sqrt(np.pi) * x * reach / nodes
    c = horizon_correction(x**2, np.full_like(x, 99.0), np.float64(1.0))  # C = 1 at the other end
    inside = x < reach - 2.0  # the sum misses what lies beyond
    # the fit is to 0.06 %; a C that is 0.1 % off, with any course, misses 1 by 0.0016 or more
    np.testing.assert_allclose((c * (kernel @ c))[inside], 1.0, atol=0.001)
