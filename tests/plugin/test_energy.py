"""Conservation of energy: white furnaces, and what stays raw."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import polar, uniform_directions
from tests.support.furnace import (
    COMBINATIONS,
    DIELECTRIC,
    SURFACES,
    assert_at_most_white,
    bsdf,
    check_combination,
    furnace_in,
    random_directions,
    steep_sinusoid,
    white_pair,
)
from tests.support.lanes import bitmap, evaluated

pytestmark = pytest.mark.usefixtures("fine")

#: Every surface with random numbers of its own.
SEEDED = [(name, seed) for seed, name in enumerate(SURFACES)]
LIGHT = [[400.0, 500.0, 600.0, 700.0]]


def thorough(test):
    """Mark a test as one of `make test-all` alone, in every variant."""
    return pytest.mark.thorough(pytest.mark.usefixtures("variant")(test))


@pytest.mark.parametrize("base", [False, True])
def test_white_furnace_of_a_dielectric(some_variant, base):
    assert_at_most_white(white_pair("rough") if base else bsdf("rough", **DIELECTRIC))


def test_a_dielectric_is_as_it_is(some_variant, coarsely):
    conserving, raw = (bsdf("sawtooth", **DIELECTRIC, energy_conserving=e) for e in (True, False))
    assert conserving.energy_conserving
    wo = uniform_directions(1000, np.random.default_rng(0))
    one, other = (evaluated(b, polar(70.0, 10.0), wo, LIGHT) for b in (conserving, raw))
    assert np.array_equal(one, other)


@pytest.mark.parametrize("material", ["Al", "none"])
def test_scales_that_come_and_go_with_the_heights_load_and_update(some_variant, coarsely, material):
    given = {"material": material, "model": "kirchhoff", "coherence_width": 18.5}
    bsdf = mi.load_dict(md.bsdf_dict(steep_sinusoid(), height_scale=0.02, **given))
    parameters = mi.traverse(bsdf)
    for height_scale in (0.002, 0.01, 0.05, 0.2, 1.0):
        parameters["height_scale"] = height_scale
        parameters.update()
        value = evaluated(bsdf, polar(70.0, 10.0), polar(70.0, 190.0), LIGHT)
        assert np.all(np.isfinite(value))
        assert value.min() > 0.0


@pytest.mark.parametrize(
    ("field", "parameters"),
    [
        each if n % 4 == 0 else pytest.param(*each, marks=pytest.mark.thorough)
        for n, each in enumerate(COMBINATIONS)
    ],
)
def test_combinations_send_on_no_more_than_they_get(mono, field, parameters):
    check_combination(field, parameters)


def test_orders_that_graze_along_steps_bring_no_light(mono):
    """The horizon cuts a lobe whose light rises as 1/cosθ: 1.18 came from 88.5°."""
    steps = 0.29 * (np.arange(13) % 8 < 4) + np.zeros((22, 1))
    field = md.HeightField(steps, (0.113, 0.0905))
    surface = mi.load_dict(md.bsdf_dict(
        field, material="none", model="kirchhoff", coherence_width=9.5, wavelength=600.0
    ))  # fmt: skip
    directions = np.array([polar(theta, -78.0) for theta in (87.4, 88.5, 89.5)])
    mean, error = furnace_in(surface, directions, 1, samples=40000)
    assert np.all(mean <= 1.01 + 3.0 * error)


def test_a_film_over_next_to_no_contrast_is_finite(mono, coarsely):
    film = {"int_ior": 1.01, "ext_ior": 1.0, "film_ior": 1.05, "film_thickness": 50.0}
    mean, _ = furnace_in(bsdf("rough", material=None, **film), np.array([polar(30.0, 0.0)]), 1)
    assert 0.0 < mean.item() < 0.1


def test_nested_light_below_0_counts_as_0(mono, coarsely):
    nested = {"type": "diffuse", "reflectance": {"type": "uniform", "value": -1.0}}
    beneath, alone = (bsdf("rough", **DIELECTRIC, **n) for n in ({"beneath": nested}, {}))
    wo = polar(20.0, 90.0)
    values = [evaluated(b, polar(30.0, 0.0), wo, 550.0) for b in (beneath, alone)]
    assert np.array_equal(*values)


@thorough
@pytest.mark.parametrize(("name", "seed"), SEEDED)
def test_white_furnace_of_one_wavelength(name, seed):
    """Mono variants make the scale at the one wavelength they have; gratings of a real metal."""
    mi.set_variant("llvm_ad_mono")
    rng = np.random.default_rng(seed)
    material = "none" if name == "rough" else "Al"
    parameters = {"material": material, "wavelength": float(rng.uniform(400.0, 700.0))}
    directions = random_directions(rng, 80.0)
    mean, error = furnace_in(bsdf(name, **parameters), directions, seed)
    raw, _ = furnace_in(bsdf(name, energy_conserving=False, **parameters), directions, seed)
    assert raw.max() > 1.02  # or there would be nothing to take
    assert np.all(mean <= 1.0 + 4.0 * error + 1e-3)
    # what may be kept is, but for the tenth that is steepest between an order and the next
    short = np.minimum(raw, 1.0) - mean > 0.03 + 4.0 * error
    assert short.mean() < 0.1


@thorough
def test_white_furnace_in_colours():
    """RGB variants have one scale for each channel, the mean over its wavelengths."""
    mi.set_variant("llvm_ad_rgb")
    directions = random_directions(np.random.default_rng(3), 80.0)
    mean, error = furnace_in(bsdf("sawtooth", coherence_width=15.0), directions, 3)
    # a mean over wavelengths is not each wavelength's value
    assert np.all(mean <= 1.0 + 4.0 * error + 5e-3)
    assert np.median(mean) > 0.9


@thorough
@pytest.mark.parametrize(("name", "seed"), SEEDED)
def test_white_furnace_at_random_directions(name, seed):
    base = name == "sawtooth"
    surface = white_pair(name, orientation=10.0 * seed) if base else bsdf(name)
    assert_at_most_white(surface, seed)


@thorough
@pytest.mark.parametrize(("name", "base"), [("sinusoid", False), ("rough", True)])
def test_white_furnace_in_its_own_shade(mono, name, base):
    load = white_pair if base else bsdf
    assert_at_most_white(load(name, shadowing="vcavity"))


@thorough
def test_white_furnace_of_the_measured_patch(mono, shared_afm):
    patch = md.HeightField.load(
        shared_afm / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375
    )
    assert_at_most_white(mi.load_dict(md.bsdf_dict(patch, material="none")))


@thorough
def test_only_the_values_change_not_the_samples():
    conserving, raw = bsdf("sinusoid"), bsdf("sinusoid", energy_conserving=False)
    si = dr.zeros(mi.SurfaceInteraction3f, 1000)
    si.wi = mi.Vector3f(polar(60.0, 10.0))
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    rng = mi.PCG32(1000)
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    context = mi.BSDFContext()
    one, other = (b.sample(context, si, *numbers)[0] for b in (conserving, raw))
    assert np.array_equal(np.array(one.wo), np.array(other.wo))
    assert np.array_equal(np.array(one.pdf), np.array(other.pdf))
    values = (np.array(b.eval(context, si, one.wo)) for b in (conserving, raw))
    assert next(values).mean() < next(values).mean()


@thorough
@pytest.mark.parametrize("name", SURFACES)
def test_a_white_base_gets_what_the_model_does_not_reflect(mono, name):
    """White Lambertian beneath: a + T ∫T cosθ/π dω, with T = 1 − a of the furnace itself."""
    alone, pair = bsdf(name, **DIELECTRIC), white_pair(name)
    directions = np.array([polar(theta, 37.0) for theta in (0.0, 50.0, 75.0)])
    reflected, error = furnace_in(alone, directions, 0)
    total, other_error = furnace_in(pair, directions, 0)
    rng = np.random.default_rng(1)
    cosine, azimuth = np.sqrt(rng.uniform(0.0, 1.0, 400)), rng.uniform(0.0, 2 * np.pi, 400)
    sine = np.sqrt(1.0 - cosine**2)
    hemisphere = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)
    mean = 1.0 - furnace_in(alone, hemisphere, 0)[0].mean()
    expected = reflected + (1.0 - reflected) * mean
    # four standard errors, and 5e-3 for the 400 directions, four wavelengths each, of the mean
    assert np.all(np.abs(total - expected) < 4.0 * (error + other_error) + 5e-3)
    assert total.max() < 1.0


@thorough
def test_the_bound_follows_height_scale(mono):
    surface = bsdf("sinusoid")
    parameters = mi.traverse(surface)
    parameters["height_scale"] = 1.3
    parameters.update()
    assert_at_most_white(surface)


@thorough
def test_a_film_s_scale_comes_and_goes_with_heights_of_a_texture(coarsely):
    heights = bitmap(np.linspace(0.002, 0.2, 16).reshape(4, 4), filter_type="bilinear")
    given = {"material": "Al", "film_ior": 1.5, "film_thickness": 100.0, "coherence_width": 18.5}
    bsdf = mi.load_dict(md.bsdf_dict(steep_sinusoid(), height_scale=heights, **given))
    si = dr.zeros(mi.SurfaceInteraction3f, 4)
    si.wi, si.uv = mi.Vector3f(polar(70.0, 10.0)), mi.Point2f([0.1, 0.4, 0.6, 0.9], 0.5)
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(polar(70.0, 190.0))))
    assert np.all(np.isfinite(value))
