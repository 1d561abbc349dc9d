"""Options that meet and look-ups beside their twins in NumPy, in a scalar variant: without kernels.

The thorough tests ask more of each: test_kinds.py, and Mitsuba's own mirrors below.
"""

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
from mitsuba_diffraction.optics.paths import ABOVE, Returned
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
from tests.support.directions import Array, as_single, polar, rough_patch
from tests.support.kinds import FILMED, lit
from tests.support.lanes import interaction
from tests.support.layered import BELOW, FLAT, INDICES, PATCH, SIDES, both, load
from tests.support.patches import SPECKLE
from tests.support.stokes import REVERSAL, bases, matrices, rotation
from tests.support.variants import use


@pytest.fixture(autouse=True)
def without_kernels() -> None:
    use("scalar_spectral_polarized")


def few(*chosen: int) -> tuple[Array, Array, Array]:
    """Pairs: the first hundred are near the mirror direction."""
    wi, wo, lam = lit("metal", 200)
    return wi[[*chosen]], wo[[*chosen]], lam[[*chosen]]


def assert_each_close(found: Array, expected: Array, relative: float, of_largest: float) -> None:
    """Compare the matrices of each pair: far from the mirror direction there is less light."""
    for one, known in zip(found, expected, strict=True):
        assert_allclose(one, known, rtol=relative, atol=of_largest * known.max())


def test_an_interface_reflects_what_an_opaque_dielectric_does():
    light = few(8, -1)
    assert_each_close(matrices(both(), *light), matrices(load(**INDICES), *light), 1e-3, 1e-5)


@pytest.mark.parametrize("kind", SIDES)
def test_light_that_goes_through_has_the_transposed_matrix_in_reverse(kind):
    wi, wo, lam = few(8, -2, -1)
    wo, bsdf = wo * BELOW, both(**SIDES[kind])
    there, back = matrices(bsdf, wi, wo, lam), matrices(bsdf, wo, wi, lam)
    there, back = (m / np.abs(w[:, None, 2, None, None]) for m, w in ((there, wo), (back, wi)))
    # importance goes along ωi, and is not n² times as large in the dielectric
    adjoint = matrices(bsdf, wo, wi, lam, "Importance") / wi[:, None, 2, None, None]
    back = back / (2.25 if kind == "dielectric" else 1.0)
    after = rotation(bases(wo), bases(-wo), wo)[:, None]
    before = rotation(bases(-wi), bases(wi), -wi)[:, None]
    expected = REVERSAL @ there.swapaxes(-1, -2) @ REVERSAL
    assert_each_close(after @ back @ before, expected, 1e-4, 1e-5)
    assert_each_close(adjoint, there, 1e-4, 1e-5)


@pytest.mark.parametrize("theta", [40.0, 140.0])
@pytest.mark.parametrize("kind", SIDES)
def test_a_sample_tells_its_side_its_component_and_the_index_that_it_enters(kind, theta):
    bsdf, si = both(**SIDES[kind]), interaction(polar(theta, 20.0), 550.0)
    samples = [bsdf.sample(mi.BSDFContext(), si, n / 16, [0.3, 0.6])[0] for n in range(16)]
    passed = [one for one in samples if one.wo.z * si.wi.z < 0.0]
    assert 0 < len(passed) < len(samples)
    for one in samples:
        assert one.sampled_component == (one in passed)
        assert (one.sampled_type == +mi.BSDFFlags.GlossyTransmission) == (one in passed)
    eta = 1.0 if kind == "sheet" else 1.5 if theta < 90.0 else 1 / 1.5
    assert [one.eta for one in passed] == pytest.approx([eta] * len(passed))


def test_below_a_sheet_light_is_that_of_air_under_a_coat_in_a_mirror():
    wi, wo, lam = few(8, -2, -1)
    found = matrices(both(thin=True), wi * BELOW, wo * BELOW, lam)
    turned = md.HeightField(-PATCH.heights, PATCH.pixel_size)
    above = matrices(load(turned, eta=1.0, k=0.0, coat_ior=1.5), wi, wo, lam)
    flip = np.diag([1.0, 1.0, -1.0, -1.0])  # axes of the image are s and −p
    before = flip @ rotation(bases(-wo * BELOW), bases(-wo) * BELOW, -wo * BELOW)
    after = rotation(bases(wi) * BELOW, bases(wi * BELOW), wi * BELOW) @ flip
    expected = after[:, None] @ above @ before[:, None]
    assert_each_close(found, expected, 2e-3, 1e-4)


def test_a_sheet_s_flat_side_sends_back_orders_by_the_depths_of_both_passages():
    wi, wo, lam = few(-2, -1)  # far from order 0
    sheet = both(thin=True)
    found = matrices(sheet, wi, wo, lam) - matrices(load(**INDICES), wi, wo, lam)
    path, k, table = Returned(None, "", ABOVE, ABOVE, sheet=1.5), wavenumber(lam), sheet.table
    (u, v, _), *ends = (wi + wo).T[:, :, None], wi[:, 2:], wo[:, 2:]
    power = table.window_sum(k * u, k * v, k * path.width(*ends)) * (k * table.sigma) ** 2 / np.pi
    expected = power * path.common(*ends, 0.0) * wo[:, 2:]
    assert_allclose(found[..., 0, 0], expected, rtol=1e-3)


LAM = np.array([450.0, 520.0, 610.0, 680.0])


@pytest.fixture
def polarised() -> None:
    """The fastest polarised variant that runs."""
    use("llvm_ad_spectral_polarized", "scalar_spectral_polarized")


@pytest.mark.thorough
@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (INDICES, {"type": "dielectric"} | INDICES),
        ({"plugin": "diffraction_dielectric"} | INDICES, {"type": "dielectric"} | INDICES),
        ({"material": "Al"}, {"type": "conductor", "material": "Al"}),
        ({"material": "Au"}, {"type": "conductor", "material": "Au"}),
    ],
)
def test_a_flat_patch_s_specular_light_is_mitsuba_s(polarised, ours, theirs, mode):
    # a lobe far from the horizon
    smooth, bsdf = mi.load_dict(theirs), load(FLAT, coherence_width=65.0, **ours)
    for theta in (0.0, 30.0, 56.0, 75.0, *((120.0, 150.0) if "plugin" in ours else ())):
        wi = as_single(polar(theta, 70.0))[None]
        si = interaction(wi, LAM[None])
        for component in range(bsdf.component_count()):
            context = mi.BSDFContext(getattr(mi.TransportMode, mode))
            context.component = component
            sample, weight = smooth.sample(context, si, 0.5, mi.Point2f(0.5))
            wo = as_single(np.array(sample.wo, float).reshape(1, 3))
            expected = np.moveaxis(np.array(weight, float).reshape(4, 4, 4), 2, 0)
            if not expected.any():  # reflected totally
                continue
            found = matrices(bsdf, wi, wo, LAM, mode)[0]
            shares = found / found[:, :1, :1], expected / expected[:, :1, :1]
            assert shares[0] == pytest.approx(shares[1], abs=2e-4)


MATERIALS = {
    "film": FILMED[0] | {"film_k": 0.1},
    "stack": {"int_ior": 1.56, "layers": 'layers = [["1.38", 0.1], ["Ag", 0.02], ["2.1", 0.15]]'},
}
#: Evenly on a sphere, as (u, v, w) of pairs of directions.
PLACES = np.random.default_rng(2).normal(size=(40, 3)) * [0.4, 0.4, 0.0] + [0.0, 0.0, 1.7]


@functools.cache
def speckle():
    """Table of amplitudes; its colours are cached."""
    return md.DiffractionTable.build(**SPECKLE)


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


def test_the_statistic_of_heights_is_the_table_s_at_every_frequency():
    roughness = load(int_ior=1.5).table.roughness
    for q in np.geomspace(0.05, 60.0, 12):
        place = mi.Vector2f(0.6 * q / 11.0, 0.8 * q / 11.0), 1.5
        (found,) = HeightStatistic(roughness).at(place, 2.0, [11.0])
        assert found.kappa == pytest.approx(33.0)
        assert found.variance == pytest.approx(roughness.at(q), rel=1e-4)


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
