"""Light of any wavelength: infrared has values, shorter waves than the table's have none."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.lanes import evaluated
from tests.support.variants import evaluate

FLAT = md.HeightField(np.zeros((8, 8)), 0.2, periodic=True)
#: nm: none, far below the table's 360, infrared, and far beyond.
LIGHT = np.array([[0.0, 1.0, 300.0, 359.0], [550.0, 831.0, 900.0, 1600.0], [3e3, 1e4, 1e6, 1e9]])
SPECTRAL = ["scalar_spectral", "llvm_ad_spectral", "llvm_ad_spectral_polarized"]


@pytest.mark.parametrize("variant", SPECTRAL)
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
def test_any_wavelength_is_finite(variant, parameters):
    mi.set_variant(variant)
    bsdf = mi.load_dict(md.bsdf_dict(FLAT, coherence_width=6.4, **parameters))
    wi, wo = (np.tile(polar(20.0, phi), (3, 1)) for phi in (0.0, 180.0))
    samples = np.random.default_rng(2).random((3, 3))
    values, *others = evaluate(bsdf, wi, wo, samples, LIGHT)
    assert np.all(values[0] == 0.0)
    assert np.all(values[1] > 0.0)
    assert all(np.isfinite(each).all() for each in (values, *others))


def test_infrared_light_has_the_lobe_of_its_wavelength():
    mi.set_variant("llvm_ad_spectral")
    bsdf = mi.load_dict(md.bsdf_dict(FLAT, coherence_width=6.4, material="none"))
    light = np.array([[500.0, 1000.0, 1500.0, 2000.0]])
    (values,) = evaluated(bsdf, polar(0.0)[None], polar(0.0)[None], light)
    # the peak of a lobe of a window's width is proportional to 1/λ²; single precision
    assert values * light[0] ** 2 == pytest.approx(values[0] * light[0, 0] ** 2, rel=1e-2)
