"""Light of any wavelength: beyond a table's, waves are its longest, and shorter ones have none."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar, rough_patch
from tests.support.lanes import evaluated
from tests.support.variants import evaluate

FLAT = md.HeightField(np.zeros((8, 8)), 0.2, periodic=True)
THROUGH = {"plugin": "diffraction_dielectric", "int_ior": 1.5, "ext_ior": 1.0}
#: nm: none, far below the table's 360, infrared, and far beyond.
LIGHT = np.array([[0.0, 1.0, 300.0, 359.0], [550.0, 831.0, 900.0, 1600.0], [3e3, 1e4, 1e6, 1e9]])
SPECTRAL = ["scalar_spectral", "llvm_ad_spectral_polarized"]


@pytest.mark.parametrize(
    "parameters",
    [
        {"material": "none"},
        {"material": "W"},
        {"material": "W", "film_ior": 1.5, "film_thickness": 100.0},
        {"material": "Al", "coat_ior": 1.5},
        {"material": "chitin"},
        {"eta": {"type": "irregular", "wavelengths": "500, 600", "values": "1, 1"}, "k": 5.0},
    ],
)
@pytest.mark.parametrize("variant", SPECTRAL)
def test_any_wavelength_is_finite(variant, parameters):
    mi.set_variant(variant)
    bsdf = mi.load_dict(md.bsdf_dict(FLAT, coherence_width=6.4, **parameters))
    wi, wo = (np.tile(polar(20.0, phi), (3, 1)) for phi in (0.0, 180.0))
    samples = np.random.default_rng(2).random((3, 3))
    values, *others = evaluate(bsdf, wi, wo, samples, LIGHT)
    assert np.all(values[0] == 0.0)
    assert np.all(values[1] > 0.0)
    assert all(np.isfinite(each).all() for each in (values, *others))


@pytest.mark.parametrize("parameters", [{"material": "Cr"}, THROUGH])
def test_light_beyond_a_table_is_that_of_its_longest_wavelength(parameters):
    mi.set_variant("llvm_ad_spectral")
    bsdf = mi.load_dict(md.bsdf_dict(rough_patch((16, 16), (0.2, 0.2), 0.1), **parameters))
    wi, wo = polar(40.0)[None], np.array([polar(30.0, 200.0), polar(70.0, 120.0), -polar(20.0)])
    light = np.array([[830.0, 840.0, 1500.0, 1e6]])
    values = evaluated(bsdf, wi.repeat(3, axis=0), wo, light.repeat(3, axis=0))
    assert values.max() > 0.0
    assert np.array_equal(values, values[:, :1].repeat(4, axis=1))


def test_a_table_of_infrared_light_has_the_lobe_of_each_wavelength():
    mi.set_variant("llvm_ad_spectral")
    table = md.DiffractionTable.build(FLAT, coherence_width=6.4, wavelength_range=(360.0, 2000.0))
    bsdf = mi.load_dict(md.bsdf_dict(table, material="none"))
    light = np.array([[500.0, 1000.0, 1500.0, 2000.0]])
    (values,) = evaluated(bsdf, polar(0.0)[None], polar(0.0)[None], light)
    # the peak of a lobe of a window's width is proportional to 1/λ²; single precision
    assert values * light[0] ** 2 == pytest.approx(values[0] * light[0, 0] ** 2, rel=1e-2)
