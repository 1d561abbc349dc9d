"""Thin films and coats over the heights: light beneath, colours, textures, and refusals."""

from __future__ import annotations

import warnings
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.optics.fresnel import Filmed
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.directions import as_single, polar
from tests.support.furnace import furnace_in, sent_on
from tests.support.lanes import bitmap, evaluated, refusal
from tests.support.layered import FLAT, PATCH, WIDTH, load, pairs
from tests.support.variants import evaluate, use

pytestmark = pytest.mark.thorough

METAL = {"eta": 0.9, "k": 6.0}
GLASS = {"int_ior": 1.56, "ext_ior": 1.0}


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
def test_in_rgb_a_mirror_has_the_film_s_colour(thickness):
    mi.set_variant("scalar_rgb")
    wi = as_single(polar(30.0))[None]
    samples, lam = np.full((1, 3), 0.5), np.full((1, 4), 550.0)
    filmed, mirror = (
        evaluate(load(FLAT, **p), wi, as_single(wi * [-1, -1, 1]), samples, lam)[0][0]
        for p in (METAL | {"film_ior": 1.45, "film_thickness": thickness}, {"material": "none"})
    )
    # what lies beyond the ends is left out, and a spline is through four points a fringe
    assert filmed / mirror == pytest.approx(film_colour(thickness), abs=5e-3)


def under_film(cosine: Any) -> Any:
    """What the film below lets through at a cosine."""
    return 1 - reflectance(cosine, Filmed(1.56, 2.2, 2 * np.pi * 120.0 / 550.0))


def under_coat(cosine: Any) -> Any:
    """What the coat below and the flat structure beneath it let through, all bounces."""
    inside = np.sqrt(1 - (1 - cosine**2) / 1.4**2)
    face, structure = reflectance(cosine, 1.4), reflectance(inside, 1.6 / 1.4)
    return (1 - face) * (1 - structure) / (1 - face * structure)


@pytest.mark.parametrize("theta", [0.0, 45.0])
@pytest.mark.parametrize("passed", [under_film, under_coat])
def test_over_white_it_returns_what_the_layer_lets_through(some_variant, passed, theta):
    white = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": 1.0}}
    if passed is under_coat:
        bsdf = load(FLAT, nested=white, int_ior=1.6, coat_ior=1.4, ext_ior=1.0)
    else:
        flat = md.HeightField(np.zeros((300, 300)), 0.08)
        wide = {"coherence_width": 24.0, "energy_conserving": True}
        bsdf = load(flat, nested=white, film_ior=2.2, film_thickness=120.0, **wide, **GLASS)
    weights = sent_on(bsdf, polar(theta)[None], 0, 550.0, samples=1 << 14)
    cosines = np.sqrt((np.arange(200) + 0.5) / 200)  # equal shares of ∫ cosθ dω
    there, back = (passed(c) for c in (np.cos(np.radians(theta)), cosines))
    expected = 1 - there + there * back.mean()
    # a lobe loses a little below the horizon, and the sum over polarisations is not of products
    assert weights.mean() == pytest.approx(expected, abs=0.01)
    assert weights.mean() < 1.0


def test_a_table_that_does_not_reach_the_heights_under_a_coat_is_one_line(some_variant, tmp_path):
    file = tmp_path / "table.exr"
    md.DiffractionTable.build(PATCH, coherence_width=WIDTH).save(file)
    plugin = {"type": "diffraction", "filename": str(file), "material": "Al"}
    mi.load_dict({**plugin, "coat_ior": 1.49, "energy_conserving": False})
    assert "height_scale_max=1.58" in refusal(lambda: mi.load_dict({**plugin, "coat_ior": 1.58}))


def shares(value: float) -> dict[str, Any]:
    """A texture of a thickness, as a share."""
    return bitmap(np.full((2, 2), value))


def of_share(value: float) -> Any:
    """Texels of such a texture of one value."""
    return dr.full(mi.TensorXf, value, (2, 2, 1))


@pytest.mark.parametrize("material", [METAL, GLASS], ids=["metal", "dielectric"])
def test_in_rgb_a_texture_s_thickness_is_the_number_s(material):
    """The thickest film tells how many wavelengths stand for a channel."""
    use("scalar_rgb")
    wi, wo, lam = (array[:12] for array in pairs(40))
    samples = np.full((len(wi), 3), 0.4)
    ends = {"film_thickness_min": 80.0, "film_thickness_max": 480.0}
    textured = load(**material, film_ior=1.6, film_thickness=shares(0.25), **ends)
    number = load(**material, film_ior=1.6, film_thickness=180.0)
    found, expected = (evaluate(bsdf, wi, wo, samples, lam) for bsdf in (textured, number))
    for one, other in zip(found, expected, strict=True):
        assert np.abs(one - other).sum() < 2e-2 * np.abs(other).sum()


def test_a_picture_s_name_stands_for_its_texture(some_variant, tmp_path):
    mi.Bitmap(np.full((2, 2), 51, np.uint8)).write(str(tmp_path / "thick.png"))  # 0.2
    wi, wo, lam = pairs(20)
    film = {"film_ior": 1.6, "film_thickness_max": 500.0}
    named = load(**METAL, **film, film_thickness=str(tmp_path / "thick.png"))
    number = load(**METAL, film_ior=1.6, film_thickness=100.0)
    expected = evaluated(number, wi, wo, lam)
    assert evaluated(named, wi, wo, lam) == pytest.approx(expected, rel=1e-4, abs=1e-7)


def test_no_thickness_of_a_texture_sends_on_more_light_than_it_gets(mono):
    grating = md.gratings.sinusoidal(1.6, 0.2, periods=1, pixels_per_period=24, rows=8)
    silver = {"eta": 0.05, "k": 4.0, "coherence_width": 8.0, "field": grating}
    # one and a half fringes
    film = {"film_ior": 1.4, "film_thickness_max": 300.0, "film_thickness": shares(0.5)}
    bsdf = load(energy_conserving=True, wavelength=550.0, **silver, **film)
    parameters, rng = mi.traverse(bsdf), np.random.default_rng(3)
    directions = np.array([polar(theta) for theta in (30.0, 75.0, 82.0)])
    for share in rng.uniform(0.0, 1.0, 6).tolist():
        parameters["film_thickness.data"] = of_share(share)
        parameters.update()
        mean, error = furnace_in(bsdf, directions, 0)
        # linear between thicknesses, where a fringe bends: 1.02 at most of 24
        assert np.all((mean > 0.9) & (mean < 1.02 + 3 * error))
    parameters["film_thickness.data"] = of_share(1.5)
    with pytest.raises(md.DiffractionError, match="film_thickness: the texture's numbers"):
        parameters.update()
