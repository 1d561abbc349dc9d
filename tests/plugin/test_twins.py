"""Look-ups of the plugin beside their twins in NumPy, in scalar variants: without a kernel."""

from __future__ import annotations

import functools
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest
from numpy.testing import assert_allclose

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.fresnel import reflectance
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.optics.materials import TISSUES
from mitsuba_diffraction.plugin.boundary import HeightStatistic
from mitsuba_diffraction.plugin.conductors import tabulated_index
from mitsuba_diffraction.plugin.direction_lookup import DirectionLookup
from mitsuba_diffraction.plugin.directions import PatchFrame, Site
from mitsuba_diffraction.plugin.energy import _excess_of, reflectors_of
from mitsuba_diffraction.plugin.energy_factors import ScaleRange
from mitsuba_diffraction.plugin.power import power_model
from mitsuba_diffraction.plugin.series import series_of
from mitsuba_diffraction.tables.colour import cached_colours
from mitsuba_diffraction.tables.directional import DirectionalTable
from mitsuba_diffraction.tables.energy.conservation import Conservation, Energy
from tests.support.directions import rough_patch
from tests.support.kinds import FILMED
from tests.support.layered import load
from tests.support.patches import SPECKLE

MATERIALS = {
    "film": FILMED[0] | {"film_k": 0.1},
    "stack": {"int_ior": 1.56, "layers": 'layers = [["1.38", 0.1], ["Ag", 0.02], ["2.1", 0.15]]'},
}
#: Evenly on a sphere, as (u, v, w) of pairs of directions.
PLACES = np.random.default_rng(2).normal(size=(40, 3)) * [0.4, 0.4, 0.0] + [0.0, 0.0, 1.7]


@pytest.fixture(autouse=True)
def without_kernels() -> None:
    mi.set_variant("scalar_spectral_polarized")


@functools.cache
def speckle():
    """Table of amplitudes; its colours are cached."""
    return md.DiffractionTable.build(**SPECKLE)


def test_order_0_and_weights_of_each_interval_are_the_table_s():
    deep = rough_patch((16, 16), (0.15, 0.15), 0.8)
    given = {"coherence_width": 2.4, "basis": "chebyshev", "tolerance": 0.02}
    table = md.DiffractionTable.build(deep, **given)
    series, expansion = series_of(table), table.expansion
    assert expansion.intervals > 1
    for kappa in expansion.kappa_max * np.linspace(0.03, 0.99, 9):
        found = series.at(float(kappa))
        assert found.interval == expansion.interval(kappa)
        assert_allclose(found.order_0, table.order_0_at(kappa), atol=1e-5)
        assert_allclose(found.weights[: expansion.terms], expansion.weights(kappa), atol=1e-5)


def test_the_statistic_of_heights_is_the_table_s_at_every_frequency():
    roughness = load(int_ior=1.5).table.roughness
    for q in np.geomspace(0.05, 60.0, 12):
        place = mi.Vector2f(0.6 * q / 11.0, 0.8 * q / 11.0), 1.5
        (found,) = HeightStatistic(roughness).at(place, 2.0, [11.0])
        assert found.kappa == pytest.approx(33.0)
        assert found.variance == pytest.approx(roughness.at(q), rel=1e-4)


def test_a_metal_s_index_is_over_that_of_the_medium_above():
    structure, si = load(material="Au", ext_ior=1.333).boundary.material, mi.SurfaceInteraction3f()
    waves = np.array([400.0, 500.0, 600.0, 700.0])
    si.wavelengths = mi.UnpolarizedSpectrum(*waves.tolist())
    expected, water = np.interp(waves, *tabulated_index("Au")) / 1.333, TISSUES["water"].index
    for dispersion in (1.0, (water(waves) / water(np.array([589.3]))).real):
        found = [complex(n.real, n.imag) for n in structure.indices(si, True)]
        # Mitsuba's spectra have even wavelengths
        assert_allclose(found, expected / dispersion, rtol=5e-3)
        structure.disperse("water", 550.0)
    assert np.ptp(dispersion) > 0.005


@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_a_material_has_its_index_up_to_the_ends_of_the_table(material, tmp_path):
    if "layers" in material:
        (tmp_path / "a.toml").write_text(material["layers"])
        material = material | {"layers": str(tmp_path / "a.toml")}
    structure, si = load(**material).boundary.material, mi.SurfaceInteraction3f()
    waves = np.array([360.0, 480.0, 650.0, 830.0])  # a stack is linear between nodes
    si.wavelengths = mi.UnpolarizedSpectrum(*waves.tolist())
    for cosine in (0.25, 0.9):
        found = [reflectance(cosine, index) for index in structure.indices(si, True)]
        expected = reflectance(np.array([cosine]), structure.at(waves)[:, None])[:, 0]
        assert_allclose(found, expected, rtol=1e-4, atol=4e-3 if "layers" in material else 0.0)


def test_in_colours_orders_and_order_0_of_a_window_add_up_to_the_table_s():
    colours = cached_colours(speckle())
    mi.set_variant("scalar_rgb")
    power = power_model(speckle(), 550.0)
    for u, v, w in PLACES.tolist():
        pair = SimpleNamespace(place=(mi.Vector2f(u, v), w))
        parts, _ = power.answers(pair, 1.0, 1.0, mi.SurfaceInteraction3f(), "v")
        others, zeroth, cosine = (np.ravel(part) for part in parts)
        total = others + zeroth + 2.0 * cosine * np.sqrt(np.abs(others * zeroth))
        assert_allclose(total, colours.colour(u, v, w)[0], atol=2e-3)


@pytest.mark.parametrize("variant", ["scalar_rgb", "scalar_spectral_polarized"])
def test_densities_over_a_stretched_patch_are_those_over_the_table_times_the_area(variant):
    mi.set_variant(variant)
    power, si = power_model(speckle(), 550.0), mi.SurfaceInteraction3f()
    if mi.is_spectral:
        si.wavelengths = mi.UnpolarizedSpectrum(450.0, 500.0, 550.0, 600.0)

    def density(stretch):
        frame = PatchFrame((1.0, 0.0), stretch)
        pair = SimpleNamespace(uv=mi.Vector2f(0.3, -0.2), w=1.5, cos_i=0.8, cos_o=0.7, asked=True)
        pair.frame, pair.outer = frame, pair
        return power.answers(pair, 1.0, 1.0, si, "d")[1]

    assert density(1.0) > 0.0
    assert density(0.7) == pytest.approx(0.49 * density(1.0))


def test_a_stretched_patch_has_the_scales_of_light_and_heights_divided_by_the_stretch():
    factors = ScaleRange((0.5, 1.0), (0.5, 1.0), True, False)
    lam, nodes = np.geomspace(*factors.wavelengths((400.0, 700.0)), 9), [0.5, 1.0, 1.5, 2.0]
    directions = np.random.default_rng(3).normal(size=(9, 3)) * [1.0, 1.0, 0.4]
    directions[:, 2] = np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    page = np.log2(lam)[:, None, None] * (1.0 + np.random.default_rng(4).random((9, 12)))
    scale = DirectionalTable(lam, page.astype(np.float32))
    pages = [[DirectionalTable(lam, node * scale.values)] for node in nodes]
    lookup, light = DirectionLookup(pages, nodes, factors), np.array([450.0, 600.0])
    for stretch, height in ((0.6, 0.8), (1.0, 0.7)):
        frame = PatchFrame((1.0, 0.0), stretch)
        site = Site(mi.SurfaceInteraction3f(), frame, height, wavenumber(light).tolist())
        for x, y, z in directions.tolist():
            # linear in the height; single precision of arccos
            angles = np.arccos(z), np.arctan2(y, x)
            expected = [height / stretch * scale.at(*angles, one) for one in light / stretch]
            assert_allclose(lookup.at(mi.Vector3f(x, y, z), site), expected, rtol=1e-5)


def test_the_energy_of_a_stretched_patch_has_the_index_of_the_light():
    boundary, light = load(material="Au").boundary, np.array([450.0, 600.0])
    (wide,), (plain,) = (reflectors_of(boundary, None, by, (400.0, 700.0)) for by in (0.7, 1.0))
    assert np.array_equal(wide.index(light / 0.7), plain.index(light))
    assert abs(np.diff(plain.index(light))[0]) > 0.5


@pytest.mark.parametrize("differentiable", [False, True])
@pytest.mark.parametrize("stretch", [1.0 - 3e-8, 1.0, 1.0 + 1e-7])
def test_a_stretch_of_1_in_single_precision_keeps_the_light(stretch, differentiable):
    """A lateral scale of 1.09 on gold took indices of light 4 % shorter, and sent on 1.07."""
    factors = ScaleRange((1.0, 1.0), (stretch, stretch), False, differentiable)
    assert factors.centre == 1.0
    assert factors.wavelengths((400.0, 700.0)) == (400.0, 700.0)


def test_one_stretch_is_exact_and_an_optimised_one_is_rounded():
    """White beneath a film of 1.7 µm on a stretched patch was 1.07: its fringes were 2 % off."""
    assert ScaleRange((1.0, 1.0), (0.117, 0.117), False, False).centre == pytest.approx(0.117)
    optimised = ScaleRange((1.0, 1.0), (0.117, 0.117), False, True)
    assert np.log2(optimised.wavelengths((1.0, 1.0))) * 8 == pytest.approx([24.0, 25.0])


def test_a_flat_coated_surface_s_own_albedo_leaves_no_excess():
    # 1.25 under the coat, of which rounding leaves all digits
    bsdf, si = load(int_ior=1.625, ext_ior=1.0, coat_ior=1.3), mi.SurfaceInteraction3f()
    (material,) = reflectors_of(bsdf.boundary, bsdf.coat, 1.0, (400.0, 700.0))
    albedo = DirectionalTable(np.array([400.0, 700.0]), np.ones((2, 9, 4), np.float32))
    rows = [np.mean(bsdf.fresnel.reflectance(c, si, True)) for c in np.cos(albedo.grid.theta)]
    flat = Conservation(DirectionalTable(albedo.wavelengths, albedo.values * np.c_[rows]))
    (excess,) = _excess_of(Energy(bsdf.table, material, (400.0, 700.0)), flat)
    assert np.abs(excess.values).max() < 1e-5
