"""Conservation of energy: white furnaces of the default; test_energy_thorough.py has others."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar
from tests.support.furnace import (
    DIELECTRIC,
    assert_at_most_white,
    bsdf,
    furnace_in,
    steep_sinusoid,
    white_pair,
)
from tests.support.lanes import evaluated

# the surfaces are steep on purpose
pytestmark = [
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("some_variant", "fine"),
]


@pytest.mark.parametrize("base", [False, True])
def test_white_furnace_of_a_dielectric(base):
    assert_at_most_white(white_pair("rough") if base else bsdf("rough", **DIELECTRIC))


def test_a_dielectric_is_as_it_is(coarsely):
    conserving, raw = (bsdf("sawtooth", **DIELECTRIC, energy_conserving=e) for e in (True, False))
    assert conserving.energy_conserving
    si = dr.zeros(mi.SurfaceInteraction3f, 1000)
    si.wi = mi.Vector3f(polar(70.0, 10.0))
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    rng = mi.PCG32(1000)
    wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
    one, other = (np.array(b.eval(mi.BSDFContext(), si, wo)) for b in (conserving, raw))
    assert np.array_equal(one, other)


def test_only_booleans_are_accepted():
    with pytest.raises((md.DiffractionError, RuntimeError), match="energy_conserving"):
        bsdf("sinusoid", energy_conserving="yes")


@pytest.mark.parametrize("material", ["Al", "none"])
def test_scales_that_come_and_go_with_the_heights_load_and_update(material, coarsely):
    given = {"material": material, "model": "kirchhoff", "coherence_width": 18.5}
    bsdf = mi.load_dict(md.bsdf_dict(steep_sinusoid(), height_scale=0.02, **given))
    parameters = mi.traverse(bsdf)
    for height_scale in (0.002, 0.01, 0.05, 0.2, 1.0):
        parameters["height_scale"] = height_scale
        parameters.update()
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi, si.wavelengths = (
            mi.Vector3f(polar(70.0, 10.0)),
            mi.Spectrum(400.0, 500.0, 600.0, 700.0),
        )
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(polar(70.0, 190.0))))
        assert np.all(np.isfinite(value))
        assert value.min() > 0.0


def noise(slope):
    """4.8 µm of isotropic noise of an RMS slope."""
    rng, pixel = np.random.default_rng(4), 0.1
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(48, pixel), np.fft.fftfreq(48, pixel)))
    spectrum = np.fft.fft2(rng.standard_normal((48, 48))) * np.exp(-((frequency / 0.9) ** 2))
    heights = np.fft.ifft2(spectrum).real
    steps = (np.roll(heights, -1, 1) - heights, np.roll(heights, -1, 0) - heights)
    rms = np.sqrt(sum((step**2).mean() for step in steps)) / pixel
    return md.HeightField(heights * (slope / rms), pixel, periodic=True)


def shallow():
    """1.6 µm period, 60 nm deep."""
    wave = 0.03 * np.cos(2 * np.pi * np.arange(64) / 64)
    return md.HeightField(np.tile(wave, (8, 1)), (0.025, 0.05), periodic=True)


FLAT = md.HeightField(np.zeros((8, 8)), 0.5, periodic=True)
SHEET = {"plugin": "diffraction_dielectric", "thin": True, "ext_ior": 1.0, "coherence_width": 5.0}
METAL = {"material": "Al", "coherence_width": 4.8}


@pytest.mark.parametrize(
    ("field", "parameters"),
    [
        (noise(0.5), METAL | {"lateral_scale": 0.5}),
        (noise(1.33), METAL | {"lateral_scale": 0.5}),
        (FLAT, SHEET | {"int_ior": 1.5, "coherence": "patch", "lateral_scale": 0.5}),
        (FLAT, SHEET | {"int_ior": 1.02, "coherence": "patch"}),
        (FLAT, {"material": "Al", "film_ior": 1.206, "film_thickness": 1638.0,
                "coherence_width": 3.0, "wavelength": 573.0}),
        (FLAT, {"material": "none", "coherence": "patch", "coherence_width": 0.5}),
        (FLAT, {"material": "none", "coherence": "patch", "coherence_width": 10.0,
                "lateral_scale": 0.1}),
        (FLAT, SHEET | {"thin": False, "int_ior": 1.5, "model": "kirchhoff",
                        "coherence_width": 1.2, "lateral_scale": 0.34, "wavelength": 624.0}),
        (shallow(), {"material": "Al", "coat_ior": 1.58, "coherence_width": 12.8}),
        (shallow(), {"material": "none", "coherence_width": 12.8}),
        (noise(0.55), METAL | {"coat_ior": 1.01}),
    ],
)  # fmt: skip
def test_combinations_send_on_no_more_than_they_get(field, parameters):
    mi.set_variant("llvm_ad_mono")
    surface = mi.load_dict(md.bsdf_dict(field, **parameters))
    angles = (30.0, 60.0, 75.0, 84.0, 87.4, 89.5, 89.8, 89.9)
    directions = np.array([polar(theta, 30.0) for theta in angles])
    mean, error = furnace_in(surface, directions, 1)
    assert np.isfinite(mean).all()
    most = np.where(np.array(angles) < 85.0, 1.01, 1.05)
    assert np.all(mean <= most + 4.0 * error), mean


def test_a_film_over_next_to_no_contrast_is_finite(coarsely):
    mi.set_variant("llvm_ad_mono")
    film = {"int_ior": 1.01, "ext_ior": 1.0, "film_ior": 1.05, "film_thickness": 50.0}
    mean, _ = furnace_in(bsdf("rough", material=None, **film), np.array([polar(30.0, 0.0)]), 1)
    assert 0.0 < mean.item() < 0.1


def test_light_before_the_table_s_wavelengths_is_0_and_infrared_light_is_looked_up(coarsely):
    mi.set_variant("llvm_ad_spectral")
    wi, mirrored = polar(30.0, 0.0), polar(30.0, 180.0)
    lit = evaluated(bsdf("rough", coat_ior=None), wi, mirrored, [[300.0, 359.0, 550.0, 900.0]])
    assert np.array_equal(lit[0] > 0.0, [False, False, True, True])


def test_nested_light_below_0_counts_as_0(coarsely):
    mi.set_variant("llvm_ad_mono")
    nested = {"type": "diffuse", "reflectance": {"type": "uniform", "value": -1.0}}
    beneath, alone = (bsdf("rough", **DIELECTRIC, **n) for n in ({"beneath": nested}, {}))
    wo = polar(20.0, 90.0)
    values = [evaluated(b, polar(30.0, 0.0), wo, 550.0) for b in (beneath, alone)]
    assert np.array_equal(*values)
