"""The surface's own reflectance; films, coats and stacks over it: colours, textures, warnings."""

from __future__ import annotations

import warnings
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.optics.fresnel import Filmed, normal_reflectance
from mitsuba_diffraction.optics.geometry import sigma_of, wavenumber
from mitsuba_diffraction.optics.mirror import mirror_cosine
from mitsuba_diffraction.optics.stack import mean_powers
from mitsuba_diffraction.plugin.conductors import tabulated_index
from mitsuba_diffraction.plugin.description import Feature, describe
from mitsuba_diffraction.plugin.stack import read_layers
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.directions import as_single, polar, uniform_directions
from tests.support.furnace import sent_on
from tests.support.lanes import bitmap, evaluated, interaction, spectra
from tests.support.layered import FLAT, load, pairs
from tests.support.stokes import matrices
from tests.support.variants import evaluate, use

PLANE = md.HeightField(np.zeros((30, 30)), 0.08)
WIDTH = 2.4


def mirror(field=PLANE, **parameters):
    """A mirror with these parameters: the model as it is, which has R as a factor."""
    raw = {"model": "kirchhoff", "energy_conserving": False, "coherence_width": WIDTH}
    return mi.load_dict(md.bsdf_dict(field, **(raw | parameters)))


def ratios(wi, wo, wavelengths, width=WIDTH, **parameters):
    """How much less than with R = 1 is reflected, (n, 4)."""
    perfect, real = (
        evaluated(mirror(coherence_width=width, **p), wi, wo, wavelengths)
        for p in ({"material": "none"}, parameters)
    )
    return real / perfect


def mirror_cosines(wi, wo):
    """cosθ at which the lobe has its reflectance: of the half vector, but near the horizon."""
    half = wi + wo
    cosine = np.sum(wi * half, axis=-1) / np.linalg.norm(half, axis=-1)
    return mirror_cosine(cosine, wi[..., 2], wo[..., 2], wavenumber(550.0) * sigma_of(WIDTH))


@pytest.fixture
def near_pairs():
    """Direction near_pairs within reach of a mirror's lobe, at all angles."""
    rng = np.random.default_rng(2)
    wi = uniform_directions(60, rng, lowest=0.15)
    wo = wi * [-1, -1, 1] + rng.normal(0, 0.05, (60, 3))
    wo = as_single(wo / np.linalg.norm(wo, axis=1, keepdims=True))
    good = wo[:, 2] > 0.05
    return wi[good], wo[good]


@pytest.mark.parametrize(
    ("parameters", "eta"),
    [
        ({}, 1.5 / 1.000277),
        ({"int_ior": 1.0, "ext_ior": 1.0}, 1.0),
        ({"int_ior": 1.33}, 1.33 / 1.000277),
        ({"int_ior": 1.7, "ext_ior": 1.2}, 1.7 / 1.2),
        ({"int_ior": "diamond", "ext_ior": "vacuum"}, 2.419),
        ({"ext_ior": 1.0}, 1.5),
    ],
)
def test_dielectrics(some_variant, near_pairs, parameters, eta):
    expected = reflectance(mirror_cosines(*near_pairs), eta)
    # Fresnel's formulas in single precision
    found = ratios(*near_pairs, 550.0, **parameters)[:, 0]
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-6 if eta == 1.0 else 0.0)


def test_a_conductor_by_its_name_is_mitsuba_s(variant):
    wavelengths = [400.0, 480.0, 560.0, 700.0]
    wi = [polar(t) for t in (0, 40, 75)]
    wo = [polar(t, 180) for t in (0, 40, 75)]
    # a wide window: a lobe far from the horizon
    ours = ratios(wi, wo, np.tile(wavelengths, (3, 1)), 65.0, material="Au")
    smooth = mi.load_dict({"type": "conductor", "material": "Au"})
    si = interaction(wi, np.tile(wavelengths, (3, 1)))
    _, theirs = smooth.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.5))
    assert ours == pytest.approx(spectra(theirs), rel=1e-4)  # the half vector, in single precision
    assert ours[0, 0] < 0.5 < ours[0, 3]  # gold is yellow


@pytest.mark.parametrize(("material", "last"), [("MgO", 767.0), ("TiN", 826.0)])
@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
def test_beyond_its_table_a_material_has_the_index_of_the_table_s_end(
    some_variant, model, material, last
):
    """Mitsuba's own conductors have the index 0 there: R = 1, and NaN in ours."""
    wi, wo = polar(40.0), polar(40.0, 180.0)
    wide = {"coherence_width": 65.0}  # a lobe far from the horizon
    bare, white = mirror(material=material, model=model, **wide), mirror(material="none", **wide)
    shares = [
        evaluated(bsdf, wi[None], wo[None], np.array([[360.5, 500.0, last, 829.5]]))[0]
        for bsdf in (bare, white)
    ]
    share = shares[0] / shares[1]
    assert share[3] == pytest.approx(share[2], rel=2e-3)  # nodes lie up to 0.7 nm further
    assert np.all((share > 0.01) & (share < 0.9))


@pytest.mark.parametrize("thickness", [20.0, 60.0, 400.0])
def test_colours_of_a_film_on_a_metal_are_those_of_its_spectrum(thickness):
    mi.set_variant("llvm_ad_rgb")
    wavelengths = np.arange(390.0, 711.0)
    film = Filmed(
        np.interp(wavelengths, *tabulated_index("Al")), 1.77, 2 * np.pi * thickness / wavelengths
    )
    weights = linear_srgb(response(wavelengths))
    expected = normal_reflectance(film) @ (weights / weights.sum(axis=0))
    bsdf = mirror(material="Al", film_ior=1.77, film_thickness=thickness)
    si = dr.zeros(mi.SurfaceInteraction3f)
    found = np.array(bsdf.eval_diffuse_reflectance(si)).ravel()
    # aluminium's index, linear between three colours; of equal energy instead of daylight 2 to 4 %
    assert found == pytest.approx(expected, rel=5e-3)


METAL = {"eta": 0.9, "k": 6.0}
GLASS = {"int_ior": 1.56, "ext_ior": 1.0}


@pytest.mark.thorough
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


@pytest.mark.thorough
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


@pytest.mark.thorough
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


@pytest.mark.thorough
@pytest.mark.parametrize("material", [METAL, GLASS], ids=["metal", "dielectric"])
def test_in_rgb_a_texture_s_thickness_is_the_number_s(material):
    """The thickest film tells how many wavelengths stand for a channel."""
    use("scalar_rgb")
    wi, wo, lam = (array[:12] for array in pairs(40))
    samples = np.full((len(wi), 3), 0.4)
    ends = {"film_thickness_min": 80.0, "film_thickness_max": 480.0}
    textured = load(**material, film_ior=1.6, film_thickness=bitmap(np.full((2, 2), 0.25)), **ends)
    number = load(**material, film_ior=1.6, film_thickness=180.0)
    found, expected = (evaluate(bsdf, wi, wo, samples, lam) for bsdf in (textured, number))
    for one, other in zip(found, expected, strict=True):
        assert np.abs(one - other).sum() < 2e-2 * np.abs(other).sum()


@pytest.mark.thorough
def test_a_picture_s_name_stands_for_its_texture(some_variant, tmp_path):
    mi.Bitmap(np.full((2, 2), 51, np.uint8)).write(str(tmp_path / "thick.png"))  # 0.2
    wi, wo, lam = pairs(20)
    film = {"film_ior": 1.6, "film_thickness_max": 500.0}
    named = load(**METAL, **film, film_thickness=str(tmp_path / "thick.png"))
    number = load(**METAL, film_ior=1.6, film_thickness=100.0)
    expected = evaluated(number, wi, wo, lam)
    assert evaluated(named, wi, wo, lam) == pytest.approx(expected, rel=1e-4, abs=1e-7)


SMALL = md.HeightField(np.zeros((8, 8)), 0.05, periodic=True)


def stack(folder, text):
    (folder / "stack.toml").write_text(text)
    return str(folder / "stack.toml")


CHITIN = 'layers = [["chitin", 0.09], ["1.33", 0.08]]\nrepeat = 6\n'


@pytest.mark.thorough
@pytest.mark.parametrize("spread", [0.0, 0.05])
def test_a_surface_reflects_what_the_stack_does_at_the_mirrors_angle(tmp_path, spectral, spread):
    file = stack(tmp_path, f"{CHITIN}spread = {spread}")
    shared = {"coherence_width": 2.0, "energy_conserving": False}
    bsdf = mi.load_dict(md.bsdf_dict(SMALL, material="1.56+0.3i", layers=file, **shared))
    perfect = mi.load_dict(md.bsdf_dict(SMALL, material="none", **shared))
    angles, lam = np.array([10.0, 30, 50]), np.array([420.0, 500, 580, 660])
    wo = [polar(angle) for angle in angles]
    ratio = np.divide(*(evaluated(b, polar(30.0, 180.0), wo, lam[None]) for b in (bsdf, perfect)))
    layers = read_layers(tmp_path / "stack.toml")
    half, towards = np.cos(np.radians(0.5 * (angles + 30))), np.cos(np.radians(angles))
    substrate = np.full((1, 4), 1.56 + 0.3j)
    indices = np.concatenate([substrate, layers.indices(lam)])
    powers = []
    for i, wavelength in enumerate(lam):
        sharpness = 2000 * np.pi / wavelength * bsdf.table.sigma_0
        cosines = mirror_cosine(half, np.cos(np.radians(30)), towards, sharpness)
        means = mean_powers(cosines, lam, indices, layers.thicknesses, spread)
        powers.append(means[i, :, :2].real.mean(axis=-1))
    # linear interpolation between 24 nodes of a fringe; single precision
    np.testing.assert_allclose(ratio, np.transpose(powers), atol=0.008)
    assert Feature.STACK in describe(bsdf).features()


@pytest.mark.thorough
def test_polarised_light_has_the_phases_of_a_film(tmp_path):
    use("llvm_ad_mono_polarized")
    shared = {"coherence_width": 8.0, "material": "Al", "energy_conserving": False}
    film = {"film_ior": 1.77, "film_thickness": 250.0, "model": "kirchhoff"}
    both = []
    for more in (film, {"layers": stack(tmp_path, 'layers = [["1.77", 0.25]]')}):
        bsdf = mi.load_dict(md.bsdf_dict(SMALL, **shared, **more))
        both.append(matrices(bsdf, polar(50.0, 180.0)[None], polar(50.0)[None], 550.0))
    # nodes over the angle
    np.testing.assert_allclose(both[1], both[0], atol=5e-3 * both[0][0, 0, 0, 0])
