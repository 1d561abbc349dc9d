"""Relative reflectance, as the thesis defines it."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import Gain
from tests.directions import polar, uniform_directions
from tests.thesis.methods.conftest import WIDTH


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
    wi, wo = uniform_directions(50, rng), uniform_directions(50, rng)
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
