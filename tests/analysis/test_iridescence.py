"""The index of iridescence: a mirror's is 0, a sinusoid's known, no width changes it."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from scipy.special import jv

from mitsuba_diffraction import HeightField, bsdf_dict, gratings
from mitsuba_diffraction.analysis.iridescence import (
    DiffractedLight,
    MaterialFactor,
    diffracted_light,
)
from mitsuba_diffraction.analysis.maps import LightDirection
from mitsuba_diffraction.analysis.scans import bsdf_of
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.tables import DiffractionTable
from tests.analysis.perfect import perfect
from tests.support.lanes import interaction, vectors

LIGHT = LightDirection(30.0, 0.0)


def light_of(field, light=LIGHT, **settings):
    settings = {"tolerance": 0.01, "wavelength_range": (380.0, 780.0), **settings}
    table = DiffractionTable.build(field, **settings)
    (found,) = diffracted_light(table, light, perfect(light))
    return found


def test_a_flat_patch_diffracts_nothing():
    result = light_of(HeightField(np.zeros((16, 16)), 0.5), coherence_width=8.0)
    assert result.iridescence() == 0.0
    assert result.share == 0.0
    assert set(result.hues().values()) == {0.0}


def sinusoid_index(period, amplitude, sigma, light):
    """Index of h = A cos(2πx/d) with Jacobi and Anger's orders J_m(κA)², every order a Gaussian."""
    u = np.arange(-1.2, 1.2, 0.01)
    v = np.arange(-0.12, 0.1201, 0.01)[:, None]
    total = 0.0
    wi = light.direction
    for wavelength in np.arange(380.0, 781.0, 4.0):
        k = 2e3 * np.pi / wavelength
        power = 0.0
        for m in range(-8, 9):
            sine = m * wavelength / (1e3 * period) - wi[0]
            if m == 0 or abs(sine) >= 1:
                continue
            wo = np.array([sine, 0.0, np.sqrt(1 - sine**2)])
            w = wi[2] + wo[2]
            share = jv(m, k * w * amplitude) ** 2
            share *= ((1 + wi @ wo) / w) ** 2 / (wi[2] * wo[2])  # Kirchhoff's, over the lobe
            lobe = np.exp(-((sigma * k) ** 2) * ((u - sine) ** 2 + v**2))
            power = power + share * k**2 * lobe
        total = total + power[..., None] * response(wavelength)
    xyz = total.reshape(-1, 3)
    xyz = xyz[xyz[:, 1] > 1e-9 * xyz[:, 1].max()]
    uv = xyz[:, :2] * [4, 9] / (xyz @ [1, 15, 3])[:, None]
    weight = xyz[:, 1] / xyz[:, 1].sum()
    return np.sqrt(weight @ np.sum((uv - weight @ uv) ** 2, axis=1))


@pytest.mark.parametrize(("period", "depth"), [(1.6, 0.1), (0.9, 0.05)])
def test_a_sinusoid_has_the_index_of_its_bessel_functions(period, depth):
    field = gratings.sinusoidal(period, depth, pixels_per_period=32, rows=2)
    # 2 %: cells and steps of both sums are finite
    expected = sinusoid_index(period, 0.5 * depth, 2.5, LIGHT)
    assert light_of(field, coherence_width=20.0).iridescence() == pytest.approx(expected, rel=0.02)


def test_the_index_depends_on_no_coherence_width_from_10_micrometres_on():
    field = gratings.elaphe_like(10.0, 160)
    narrow, wide = (light_of(field, coherence_width=w) for w in (10.0, 40.0))
    assert wide.iridescence() == pytest.approx(narrow.iridescence(), rel=0.01)  # the tolerance
    assert wide.share == pytest.approx(narrow.share, rel=0.01)
    assert sum(wide.hues().values()) == pytest.approx(1.0)


def test_a_single_colour_is_not_iridescent_and_a_rainbow_is():
    brightness = np.random.default_rng(1).uniform(0.1, 3.0, (32, 32, 1))
    red = DiffractedLight(brightness * response(620.0), 0.5)
    assert red.iridescence() < 1e-6
    assert red.hues()["red"] > 0.99
    rainbow = DiffractedLight(response(np.linspace(450.0, 650.0, 50))[None], 0.5)
    pale = DiffractedLight(rainbow.xyz + 3 * rainbow.xyz.mean(axis=(0, 1)), 0.5)
    assert rainbow.iridescence() > 0.15
    assert pale.iridescence() < 0.5 * rainbow.iridescence()


@pytest.mark.parametrize("surface", [{}, {"coat_ior": 1.33, "material": "keratin"}])
def test_a_material_s_factor_is_the_plugin_s_at_any_azimuth(variant, surface):
    if variant != "llvm_ad_spectral":
        pytest.skip("the factor is of wavelengths")
    table = DiffractionTable.build(gratings.sinusoidal(1.6, 0.05, rows=2), tolerance=0.05)
    bsdf = bsdf_of(bsdf_dict(table, energy_conserving=False, **surface))
    light = LightDirection(35.0, 70.0)
    generator = np.random.default_rng(4)
    radius, angle = np.sqrt(generator.random(200)) * 0.98, generator.uniform(0.0, 2 * np.pi, 200)
    sines = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    value, w = MaterialFactor.of(bsdf, 35.0).at(light)(sines, 505.0)
    si = interaction(np.tile(light.direction, (200, 1)), 505.0)
    wo = vectors(np.column_stack([sines, np.sqrt(1.0 - radius**2)]))
    site = bsdf.site_at(si, mi.Mask(True))
    expected, expected_w = bsdf.material_factor(bsdf.pair(site, wo, mi.Mask(True)), site)
    # linear between directions one and five degrees apart
    np.testing.assert_allclose(value, np.array(expected[0]), rtol=0.01)
    np.testing.assert_allclose(w, np.array(expected_w), rtol=1e-3)
