"""The whole spectrum, against the reference integral and sums written out; relative reflectance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.optics.geometry import sigma_of, wavenumber
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import Gain
from mitsuba_diffraction.thesis.methods.method import trapezoid_rule
from tests.support.directions import lit_pairs, polar, uniform_directions

#: Coherence width, µm: narrower than the rough patch.
WIDTH = 12.0


@pytest.mark.parametrize(
    ("name", "coherence"), [("spectral", "ensemble"), ("flss", "patch"), ("flss", "ensemble")]
)
def test_one_wavelength_is_the_reference(rough, name, coherence):
    wi, wo, wavelength, _ = lit_pairs(rough, sigma_of(WIDTH), 160, seed=3)
    wavelength = np.maximum(wavelength, 380.0)
    exact = reference.brdf(rough, wi, wo, wavelength, coherence_width=WIDTH, coherence=coherence)
    method = methods.make(name, rough, coherence_width=WIDTH, coherence=coherence)
    # the tolerance of the tables, 1e-3, is on this sum at the worst κ
    assert np.abs(method.brdf(wi, wo, wavelength) - exact).sum() <= 1e-3 * exact.sum()


def test_colours_are_the_trapezoidal_sum_of_the_reference(rough):
    rng = np.random.default_rng(1)
    wi, wo = uniform_directions(6, rng, 0.4), uniform_directions(6, rng, 0.4)
    method = methods.make(
        "flss", rough, coherence_width=WIDTH, wavelength_range=(400.0, 700.0), step=50.0
    )
    expected = np.zeros((6, 3))
    for n, lam in enumerate(range(400, 701, 50)):
        weight = 25.0 if n in (0, 6) else 50.0
        f = reference.brdf(rough, wi, wo, lam, coherence_width=WIDTH, coherence="patch")
        expected += weight * f[:, None] * response(lam)
    # the tolerance of the table on each pair's own light, most of it far from the brightest order
    np.testing.assert_allclose(method.xyz(wi, wo), expected, rtol=1e-2)
    assert np.abs(method.xyz(wi, wo) - expected).sum() < 1e-3 * expected.sum()


@given(st.floats(200.0, 500.0), st.floats(1.0, 400.0), st.floats(0.1, 100.0))
def test_the_trapezoidal_rule_covers_the_range(low, length, step):
    nodes, weights = trapezoid_rule((low, low + length), min(step, 0.99 * length))
    assert nodes[0] == low
    assert nodes[-1] == pytest.approx(low + length, rel=1e-8)
    assert np.all(np.diff(nodes) <= step * (1 + 1e-9))
    # exact for straight lines
    assert weights.sum() == pytest.approx(length, rel=1e-8)
    assert weights @ nodes == pytest.approx(0.5 * ((low + length) ** 2 - low**2), rel=1e-8)


def test_a_mirror_s_relative_reflectance_is_white_at_normal_incidence():
    flat = HeightField(np.zeros((16, 16)), 0.5, name="flat")
    method = methods.make("flss", flat, coherence_width=WIDTH)
    up = polar(0.0)
    assert method.relative(up, up, 550.0)[0] == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(
        method.linear_srgb(up, up, gain=Gain())[0], 1.0, atol=2e-3  # 360–380 nm is left out
    )  # fmt: skip


def test_relative_reflectance_has_neither_wavelength_nor_area(rough, of_rough):
    rng = np.random.default_rng(2)
    wi, wo = uniform_directions(80, rng), uniform_directions(80, rng)
    # order 0 of f is a mirror's lobe: amplitudes are below exp(−24) of it here, at 700 nm
    off = np.hypot(*(wi + wo)[:, :2].T) * wavenumber(700.0) * sigma_of(WIDTH) > 7.0
    wi, wo = wi[off], wo[off]
    assert len(wi) > 50
    method = of_rough["flss"]
    for wavelength in (400.0, 700.0):
        f = method.brdf(wi, wo, wavelength)
        ratio = method.relative(wi, wo, wavelength, Gain(shadowing="none")) / f
        # C·S over f: F²/F0² · cosθi · λ² / 4πσ²
        half = np.sqrt((1 + np.sum(wi * wo, axis=1)) / 2)
        fresnel = 0.04 + 0.96 * (1 - half) ** 5
        expected = (fresnel / 0.04) ** 2 * wi[:, 2] * (wavelength * 1e-3) ** 2
        expected /= 4 * np.pi * (WIDTH / 4) ** 2
        # the directions are unit vectors in single precision only
        np.testing.assert_allclose(ratio, expected, rtol=1e-6)


def test_grooves_shadow_at_grazing_angles_only():
    shadowed, open_ = Gain(), Gain(shadowing="none")
    wi, up = polar(0.0)[None], polar(20.0)[None]
    assert shadowed.factor(wi, up) == open_.factor(wi, up)
    grazing = polar(85.0)[None]
    assert shadowed.factor(wi, grazing) < 0.5 * open_.factor(wi, grazing)


def test_light_from_below_is_none(rough, of_rough):
    wi, wo = polar(30.0), polar(120.0)
    for method in of_rough.values():
        assert method.brdf(wi, wo, 550.0) == 0.0
        assert np.all(method.xyz([wi, wo], [wo, wi]) == 0.0)
