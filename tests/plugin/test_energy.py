"""Conservation of energy: white furnaces of surfaces on one side or both, and what stays raw."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy.conservation import Conservation, SurfaceEnergy
from mitsuba_diffraction.tables.energy.conserved import Transmitter
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from tests.support.coarse import energy_as
from tests.support.directions import polar, rough_patch, uniform_directions
from tests.support.furnace import (
    DIELECTRIC,
    FURNACES,
    FURNACES_MORE,
    SURFACES,
    WHITE,
    bsdf,
    check_furnace,
    furnace_in,
    random_directions,
    sent_on,
    steep_sinusoid,
)
from tests.support.lanes import bitmap, evaluated
from tests.support.layered import SIDES, both

pytestmark = pytest.mark.usefixtures("fine")

#: Every surface with random numbers of its own.
SEEDED = [(name, seed) for seed, name in enumerate(SURFACES)]
LIGHT = [[400.0, 500.0, 600.0, 700.0]]


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
    "name", [*FURNACES, *(pytest.param(name, marks=pytest.mark.thorough) for name in FURNACES_MORE)]
)
def test_no_surface_sends_on_more_than_it_gets(name):
    check_furnace(name)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_sums_are_integrals_where_light_leaves_flatter_than_it_came(mono, side):
    """q above is larger than q below then: κ < 0, and the heights seem turned over."""
    heights = 0.3 * np.tile(np.arange(24) / 24.0, (37, 1))
    field, index = md.HeightField(heights, (0.079, 0.0466)), 1.07
    narrow = {"coherence": "patch", "coherence_width": 0.71}
    sheet = {"plugin": "diffraction_dielectric", "thin": True, "int_ior": index, "ext_ior": 1.0}
    surface = mi.load_dict(md.bsdf_dict(
        field, wavelength=483.0, energy_conserving=False, **sheet, **narrow
    ))  # fmt: skip
    cosine = ((np.arange(256) + 0.5) / 256) ** 2
    cosine, turn = np.meshgrid(cosine, (np.arange(256) + 0.5) * (np.pi / 128))
    sine = np.sqrt(1.0 - cosine**2)
    areas = np.sqrt(cosine).ravel() * (np.pi / 128**2)  # dωo by midpoints
    wi, total = polar(60.0, 17.0) * [1.0, 1.0, side], 0.0
    for z in (cosine, -cosine):
        wo = np.stack([sine * np.cos(turn), sine * np.sin(turn), z], axis=-1).reshape(-1, 3)
        total += (np.ravel(evaluated(surface, wi, wo, 483.0)) * areas).sum()
    table = md.DiffractionTable.build(field, height_scale_max=index, **narrow)
    sums = SurfaceEnergy(table, Transmitter(index, "small_slope", True))
    found, _ = sums.albedos(Conservation(), np.radians([60.0]), np.radians([17.0]), 483.0)
    assert found[int(side < 0.0)].item() == pytest.approx(total, rel=0.01)  # as of narrow windows


def test_nested_light_below_0_counts_as_0(mono, coarsely):
    nested = {"type": "diffuse", "reflectance": {"type": "uniform", "value": -1.0}}
    beneath, alone = (bsdf("rough", **DIELECTRIC, **n) for n in ({"beneath": nested}, {}))
    wo = polar(20.0, 90.0)
    values = [evaluated(b, polar(30.0, 0.0), wo, 550.0) for b in (beneath, alone)]
    assert np.array_equal(*values)


@pytest.mark.thorough
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


@pytest.mark.thorough
@pytest.mark.parametrize("name", SURFACES)
def test_a_white_base_gets_what_the_model_does_not_reflect(mono, name):
    """White Lambertian beneath: a + T ∫T cosθ/π dω, with T = 1 − a of the furnace itself."""
    alone, pair = bsdf(name, **DIELECTRIC), bsdf(name, **DIELECTRIC, **WHITE)
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


@pytest.mark.thorough
def test_a_film_s_scale_comes_and_goes_with_heights_of_a_texture(some_variant, coarsely):
    heights = bitmap(np.linspace(0.002, 0.2, 16).reshape(4, 4), filter_type="bilinear")
    given = {"material": "Al", "film_ior": 1.5, "film_thickness": 100.0, "coherence_width": 18.5}
    bsdf = mi.load_dict(md.bsdf_dict(steep_sinusoid(), height_scale=heights, **given))
    si = dr.zeros(mi.SurfaceInteraction3f, 4)
    si.wi, si.uv = mi.Vector3f(polar(70.0, 10.0)), mi.Point2f([0.1, 0.4, 0.6, 0.9], 0.5)
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(polar(70.0, 190.0))))
    assert np.all(np.isfinite(value))


FIELDS = {
    "flat": md.HeightField(np.zeros((8, 8)), 8.0),
    "50 nm": rough_patch((48, 48), (0.1, 0.1), 0.05, 1.0),
    "5 nm": rough_patch((200, 200), (0.1, 0.1), 0.005, 1.0),
}
#: From above and from below.
DIRECTIONS = np.array([polar(theta, 20.0) * [1, 1, side] for theta in (0, 45) for side in (1, -1)])


@pytest.mark.usefixtures("some_variant", "coarsely")
@pytest.mark.parametrize("kind", SIDES)
@pytest.mark.parametrize(
    ("field", "index", "width", "more", "within"),
    [
        # the table's tolerance
        ("5 nm", 1.2, 65.0, {}, 5e-3),
        ("flat", 1.06, 10.0, {}, 5e-3),
        # orders interfere with one another, and in reflected light with order 0; the density of
        # speckle is linear between samples of κ and of directions
        ("50 nm", 1.3, 3.0, {"coherence": "patch"}, 2e-2),
    ],
)
def test_all_light_is_sent_on_and_none_comes_from_nothing(kind, field, index, width, more, within):
    parameters = {"int_ior": index, "ext_ior": 1.0, "coherence_width": width, **SIDES[kind], **more}
    bsdf = mi.load_dict(md.bsdf_dict(FIELDS[field], "diffraction_dielectric", **parameters))
    lam = [410.0, 500.0, 590.0, 690.0]
    weights = sent_on(bsdf, DIRECTIONS, 0, lam, "Importance", samples=1 << 12)
    # 4 standard errors of 64 trials
    error = weights.std(axis=2) / 2.0**6
    assert np.all(np.abs(weights.mean(axis=2) - 1.0) < 4.0 * error + within)
    assert weights.max() < 20.0 or more  # one of ten samples or more is drawn from each side


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "theta", "lengths", "width"),
    [
        ("dielectric", 60.0, (2.5, 0.08), 20.0),
        ("sheet", 75.0, (1.1, 0.06), 40.0),
    ],
)
def test_conserved_both_sides_add_up_to_all_light(some_variant, kind, theta, lengths, width):
    period, depth = lengths
    size = {"periods": math.ceil(width / period), "pixels_per_period": math.ceil(period / 0.0895)}
    grating = md.gratings.sinusoidal(period, depth, **size)
    common = {"field": grating, "coherence_width": width, **SIDES[kind]}
    light = {"wavelength": 550.0, "mode": "Importance", "samples": 1 << 15}
    with energy_as(EnergySettings(side_wavelengths=3, azimuthal=36)):  # one at 550
        (raw, error), (conserved, _) = (
            furnace_in(both(energy_conserving=e, **common), polar(theta, 20.0)[None], 0, **light)
            for e in (False, True)
        )
    # first order gains light, and a sheet loses the light beyond its critical angle
    assert np.all(raw > 1.0 + 3 * error if kind == "dielectric" else raw < 0.99 - 3 * error)
    assert np.all((0.98 - 3 * error < conserved) & (conserved < 1.001 + 3 * error))
