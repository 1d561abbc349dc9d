"""A thin film over the heights: values, limits, colours, and what is refused."""

from __future__ import annotations

import warnings
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.plugin.layers import Channels
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.directions import as_single, polar
from tests.support.lanes import evaluated, interaction
from tests.support.layered import FLAT, PATCH, load, pairs
from tests.support.variants import evaluate

pytestmark = pytest.mark.thorough

OXIDE = {"film_ior": 1.77, "film_thickness": 250.0}
METAL = {"eta": 0.9, "k": 6.0}
GLASS = {"int_ior": 1.56, "ext_ior": 1.0}


def test_a_height_scale_is_as_heights(some_variant):
    wi, wo, lam = pairs(100)
    half = md.HeightField(0.5 * PATCH.heights, PATCH.pixel_size)
    scaled = evaluated(load(height_scale=0.5, **METAL, **OXIDE), wi, wo, lam)
    lower = evaluated(load(half, **METAL, **OXIDE), wi, wo, lam)
    # both tables' tolerance, as above
    assert scaled == pytest.approx(lower, rel=2e-3, abs=2e-5 * lower.max())


@pytest.mark.parametrize("material", [METAL, GLASS], ids=["metal", "dielectric"])
@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
def test_films_that_are_none_leave_the_surface_bare(some_variant, material, model):
    wi, wo, lam = pairs(60)
    bare = evaluated(load(model=model, **material), wi, wo, lam)
    for film in (
        {"film_ior": 1.8, "film_thickness": 0.0},
        {"film_ior": 1.0, "film_thickness": 300.0},
    ):
        filmed = evaluated(load(model=model, **material, **film), wi, wo, lam)
        # of sums that cancel, in single precision
        assert filmed == pytest.approx(bare, rel=5e-5, abs=2e-6 * bare.max())


@pytest.mark.parametrize(
    ("depth", "thickness", "warned"),
    [(0.08, 700.0, True), (0.06, 700.0, False), (0.1, 400.0, False)],
)
def test_where_the_model_does_not_follow_the_fringes_it_says_so(
    some_variant, depth, thickness, warned
):
    grating = md.gratings.sinusoidal(2.5, depth, periods=4, pixels_per_period=28)
    lacquer = METAL | {"film_ior": 1.5, "film_thickness": thickness}
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        load(grating, **lacquer)
    assert any("film_thickness=700 nm on a metal" in str(one.message) for one in heard) == warned


def film_colour(thickness: float) -> Any:
    """Linear sRGB of a flat film of index 1.45 on metal at 30°, summed over all wavelengths."""
    lam = np.arange(380.0, 781.0)
    index = Filmed(0.9 + 6.0j, 1.45, 2 * np.pi * thickness / lam)
    weights = linear_srgb(response(lam)).T
    return weights @ reflectance(np.cos(np.radians(30.0)), index) / weights.sum(axis=1)


@pytest.mark.parametrize("thickness", [0.0, 100.0, 300.0, 1000.0, 4000.0])
def test_a_few_wavelengths_make_a_film_s_colour(some_variant, thickness):
    found = Channels.of(2 * 1.45 * thickness)
    index = Filmed(0.9 + 6.0j, 1.45, 2 * np.pi * thickness / np.array(found.wavelengths))
    powers = reflectance(np.cos(np.radians(30.0)), index)
    # what lies beyond the ends is left out, and a spline is through four points a fringe
    assert np.array(found.weights) @ powers == pytest.approx(film_colour(thickness), abs=5e-3)


def test_in_rgb_a_mirror_has_the_film_s_colour():
    mi.set_variant("scalar_rgb")
    wi = as_single(polar(30.0))[None]
    samples, lam = np.full((1, 3), 0.5), np.full((1, 4), 550.0)
    filmed, mirror = (
        evaluate(load(FLAT, **p), wi, as_single(wi * [-1, -1, 1]), samples, lam)[0][0]
        for p in (METAL | {"film_ior": 1.45, "film_thickness": 300.0}, {"material": "none"})
    )
    assert filmed / mirror == pytest.approx(film_colour(300.0), abs=5e-3)


@pytest.mark.parametrize("theta", [0.0, 45.0])
def test_over_white_it_returns_what_the_film_lets_through(some_variant, theta):
    count = 1 << 14
    white = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 1.0}}
    film = {"film_ior": 2.2, "film_thickness": 120.0}
    flat = md.HeightField(np.zeros((300, 300)), 0.08)
    wide = {"coherence_width": 24.0, "energy_conserving": True}
    bsdf = load(flat, nested=white, **wide, **GLASS, **film)
    si = interaction(np.tile(as_single(polar(theta)), (count, 1)), 550.0)
    rng = mi.PCG32(count)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    weights = np.array(bsdf.sample(mi.BSDFContext(), si, one, two)[1], float)[0]
    cosines = np.sqrt((np.arange(200) + 0.5) / 200)  # equal shares of ∫ cosθ dω
    filmed = Filmed(1.56, 2.2, 2 * np.pi * 120.0 / 550.0)
    there, back = (1 - reflectance(c, filmed) for c in (np.cos(np.radians(theta)), cosines))
    expected = 1 - there + there * back.mean()
    # a lobe loses a little below the horizon
    assert weights.mean() == pytest.approx(expected, abs=0.01)
