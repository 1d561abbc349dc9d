"""What the BSDF returns: its table at any wavelength and angle, nothing below, an albedo.

The table may be of a small scan, whose order 0 has the light's window, or end at a frequency.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from mitsuba_diffraction.plugin.device_table import device_table
from tests.support.directions import lit_pairs, polar, rough_patch, uniform_directions
from tests.support.gentle import load, pairs
from tests.support.lanes import (
    brdf_values,
    evaluated,
    interaction,
    lanes,
    refusal,
    spectra,
    vectors,
)
from tests.support.patches import SMALL_SCAN
from tests.support.variants import evaluate, use


@pytest.mark.parametrize("basis", ["svd", "chebyshev", "taylor"])
@pytest.mark.parametrize("coherence", md.reference.COHERENCES)
def test_the_plugin_is_its_table(variant, coherence, basis):
    bsdf = load(coherence=coherence, basis=basis, tolerance=1e-4)
    wi, wo, lam = pairs()
    expected = bsdf.table.brdf(wi, wo, lam)
    value = brdf_values(bsdf, wi, wo, lam[:, None])
    # single precision in phases: positions of up to 50 bins to 1e-5 of one, under Gaussians whose
    # exponents are at most 10 times that far from the centre
    assert np.sum(np.abs(value - expected)) < 3e-6 * np.sum(expected)
    assert value == pytest.approx(expected, rel=1e-3, abs=1e-5 * expected.max())


def test_nothing_is_reflected_from_or_to_below(variant):
    bsdf = load()
    wi, wo, lam = pairs()
    down = [1, 1, -1]
    for incident, outgoing in ((wi, wo * down), (wi * down, wo), (wi * down, wo * down)):
        assert np.array_equal(evaluated(bsdf, incident, outgoing, lam[:, None]), np.zeros((200, 4)))
        si = interaction(incident, lam[:, None])
        pdf = np.array(bsdf.pdf(mi.BSDFContext(), si, vectors(outgoing)))
        assert np.array_equal(pdf, np.zeros(200))


def test_masked_lanes_are_zero(variant):
    bsdf = load()
    wi, wo, lam = pairs()
    active = mi.Mask(np.arange(200) % 2 == 0)
    si, context = interaction(wi, lam[:, None]), mi.BSDFContext()
    value = bsdf.eval(context, si, vectors(wo), active)
    density = bsdf.pdf(context, si, vectors(wo), active)
    sample, weight = bsdf.sample(context, si, 0.3, mi.Point2f(0.2, 0.4), active)
    dr.eval(value, density, sample, weight)  # one kernel instead of four
    value = spectra(value)
    assert np.all(value[1::2] == 0)
    # a cut series may dip below zero where it is dark, and is 0 there
    assert np.mean(value[::2].sum(axis=1) > 0) > 0.95
    assert np.all(np.array(density)[1::2] == 0)
    assert np.all(spectra(weight)[1::2] == 0)
    assert np.all(np.array(sample.pdf)[1::2] == 0)


def test_the_ends_of_the_range_are_served(variant):
    # the shortest wavelength, straight up and down, at the largest scale: κ_max itself, rounded
    bsdf = load(height_scale=1.0)
    parameters = mi.traverse(bsdf)
    parameters["height_scale"] = bsdf.table.height_scale_max
    parameters.update()
    assert np.all(np.isfinite(evaluated(bsdf, polar(0), [polar(0)], 360.0)))
    # and |(u, v)| = 2, all but
    grazing = polar(89.99)
    assert np.all(np.isfinite(evaluated(bsdf, grazing, [grazing], 360.0)))


PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}


@pytest.mark.thorough
@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        ({"material": "none"}, 1.0),
        ({"int_ior": 1.5}, 0.04),
        ({"material": "Al"}, 0.92),
        ({"int_ior": 1.5, "beneath": PIGMENT}, 0.04 + 0.5 * 0.96**2),
        ({"int_ior": 1.5, "beneath": {"type": "roughconductor", "alpha": 0.01}}, 1.0),
    ],
)
def test_the_albedo_is_the_same_from_all_sides_and_at_most_1(variant, surface, expected):
    use(variant)
    bsdf = load(**surface)
    found = np.array(
        [
            spectra(bsdf.eval_diffuse_reflectance(interaction(polar(theta), 550.0)))[0]
            for theta in (0.0, 30.0, 60.0)
        ]
    )
    assert np.all((found >= 0.0) & (found <= 1.0))
    assert found == pytest.approx(expected, abs=0.01)
    assert np.ptp(found, axis=0) == pytest.approx(0.0, abs=1e-6)


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


@pytest.mark.thorough
@pytest.mark.parametrize(
    "parameters", [{}, {"energy_conserving": True}, {"shadowing": "vcavity"}, {"int_ior": 1.5}]
)
@pytest.mark.parametrize("theta", [89.0, 89.99])
def test_reciprocity_near_the_horizon(some_variant, theta, parameters):
    bsdf = load(**parameters)
    rng = np.random.default_rng(0)
    wi = np.array([polar(t, p) for t, p in rng.uniform((0, 0), (60, 360), (100, 2))], "f4")
    wo = np.array([polar(theta, p) for p in rng.uniform(0, 360, 100)], "f4")
    there = evaluated(bsdf, wi, wo, 550.0) / wo[:, 2:]
    back = evaluated(bsdf, wo, wi, 550.0) / wi[:, 2:]
    # a dozen operations in single precision
    assert there == pytest.approx(back, rel=1e-6)


@pytest.mark.thorough
def test_a_density_below_single_precision_draws_nothing(monkeypatch):
    mi.set_variant("scalar_spectral")
    bsdf = mi.load_dict(md.bsdf_dict(FLAT, coherence_width=2.0))
    # double precision; as a number of a spectrum it is 0
    monkeypatch.setattr(type(bsdf), "evaluated", lambda *_: (mi.Spectrum(1.0), 1e-60))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.wavelengths = mi.Vector3f(polar(20)), mi.Spectrum(500.0)
    sample, weight = bsdf.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.4, 0.6))
    assert sample.pdf == 0.0
    assert not any(weight)


MIRROR = {"material": "none", "energy_conserving": False}
SIGMA_0 = 65.0 / 4.0


def of_scan(**parameters):
    return mi.load_dict(md.bsdf_dict(SMALL_SCAN, **parameters))


@pytest.mark.parametrize(
    ("parameters", "reference"),
    [
        (MIRROR, {}),
        ({"int_ior": 1.5, "ext_ior": 1.0}, {"eta": 1.5}),
        ({"int_ior": 1.5, "ext_ior": 1.0, "coat_ior": 1.3}, {"eta": 1.5, "coat": 1.3}),
    ],
    ids=["mirror", "dielectric", "coat"],
)
def test_values_are_those_of_the_model(some_variant, parameters, reference):
    wi, wo, lam, near = lit_pairs(SMALL_SCAN, SIGMA_0, 60, 5)
    assert near.any()
    conserving = {"energy_conserving": False}
    bsdf = of_scan(**(conserving | parameters))
    found = brdf_values(bsdf, wi, wo, lam[:, None])
    exact = md.reference.brdf(SMALL_SCAN, wi, wo, lam, **reference)
    factor = kirchhoff_factor(wi, wo, lam, 1.0)
    difference, scale = np.abs(found - exact) / factor, exact / factor
    for part in (near, ~near):
        # the tolerance of the table; roughness as a table adds 1e-3 (`optics.blend`)
        assert difference[part].sum() < 2e-3 * scale[part].sum()


@pytest.mark.thorough
def test_colours_are_those_of_the_wavelengths():
    mi.set_variant("llvm_ad_rgb")
    bsdf = of_scan(**MIRROR)
    table = bsdf.table
    lam = np.arange(376.0, 744.0, 0.5) + 0.25
    weights = linear_srgb(response(lam))
    weights /= weights.sum(axis=0)
    for theta in (0.3, 1.0, 20.0):
        wi, wo = polar(30.0, 180.0), polar(30.0 + theta, 0.0)
        exact = table.brdf(np.tile(wi, (lam.size, 1)), wo, lam) @ weights * wo[2]
        found = np.array(evaluated(bsdf, wi, wo, 550.0)).ravel()[:3]
        # linear between 256 radii of the lobe, and eight digits of the sums
        assert found == pytest.approx(exact, rel=0.02, abs=2e-3 * np.abs(exact).max())


#: Of coarse pixels: small tables. The plugin warns of that, and of the limit.
COARSE = rough_patch((64, 64), (0.3, 0.3), 0.2)


@pytest.fixture(scope="module")
def table():
    return md.DiffractionTable.build(COARSE, coherence_width=18.0, frequency_limit=(6.0, 5.0))


@pytest.fixture(scope="module")
def saved(table, tmp_path_factory):
    file = tmp_path_factory.mktemp("limited") / "table.exr"
    table.save(file)
    return str(file)


def lookups(count):
    """Random (qx, qy, κ), some of which no light can probe."""
    rng = np.random.default_rng(2)
    angle, radius = rng.uniform(0, 2 * np.pi, count), 36.0 * rng.uniform(0, 1, count)
    values = radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0.5, 54.0, count)
    return [v.astype(np.float32).astype(float) for v in values]


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "scalar_spectral"])
def test_the_plugin_reads_what_numpy_reads(variant, table):
    use(variant)
    x, y, kappa = lookups(2000 if dr.is_jit_v(mi.Float) else 60)
    device = device_table(table)
    if dr.is_jit_v(mi.Float):
        values = np.array(device.window_sum(*map(lanes, (x, y, kappa))))
    else:
        values = [device.window_sum(*map(float, q)) for q in zip(x, y, kappa, strict=True)]
    expected = table.window_sum(x, y, kappa)
    assert np.isnan(expected).any()
    assert (expected == 0.0).any()
    # sums of float32 products: 1e-5 of the largest
    largest = np.nanmax(expected)
    assert values == pytest.approx(expected, rel=1e-4, abs=1e-6 * largest, nan_ok=True)


def test_the_surface_is_dark_beyond_the_limit_and_never_not_a_number(some_variant, saved):
    bsdf = mi.load_dict({"type": "diffraction", "filename": saved, "material": "none"})
    wi, wo = polar(50.0, 20.0), uniform_directions(400, np.random.default_rng(4))
    values = evaluated(bsdf, wi, wo, 450.0)
    q = 2e3 * np.pi / 450.0 * (wi + wo)[:, :2]
    inside = np.hypot(q[:, 0] / 6.0, q[:, 1] / 5.0) <= 1.0
    assert np.isfinite(values).all()
    assert np.all(values[~inside] == 0.0)
    assert np.all(values[inside] > 0.0)


def test_rgb_variants_refuse_it(saved):
    mi.set_variant("llvm_ad_rgb")
    line = refusal(lambda: mi.load_dict({"type": "diffraction", "filename": saved}))
    assert "RGB variants" in line
