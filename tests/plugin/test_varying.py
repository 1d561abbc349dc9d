"""Parameters that vary over a surface, its window where the light falls, and `lateral_scale`."""

from __future__ import annotations

import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.geometry import kirchhoff_factor, sigma_of
from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.plugin.varying import PRECISION
from tests.support.directions import lit_pairs, polar, uniform_directions
from tests.support.gentle import PATCH, UV, WIDTH, directions, hits, load, pairs
from tests.support.lanes import bitmap, evaluated, interaction, refusal, spectra, vectors


@pytest.mark.parametrize(
    ("texture", "mend"),
    [
        ({"raw": False}, "raw"),
        ({"channels": 1}, "has three"),
        ({"levels": 255}, r"save \(1 \+ cos\)/2 .* as EXR"),
        ({"levels": 65535}, r"save \(1 \+ cos\)/2 .* as EXR"),
    ],
)
def test_a_picture_that_holds_no_directions_is_refused(every_variant, texture, mend):
    said = refusal(lambda: load(orientation=directions([10.0, 120.0, 200.0, 300.0], **texture)))
    assert said.startswith("orientation: ")
    assert re.search(mend, said)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("degrees", [10.0, 120.0, 200.0, 300.0])
def test_integers_hold_directions_to_the_stated_precision(some_variant, bits, degrees):
    levels, angle = 2**bits - 1, np.deg2rad(degrees)
    doubled = np.array([1.0 + np.cos(angle), 1.0 + np.sin(angle), 1.0]) / 2.0
    bsdf = load(orientation=bitmap(np.tile(np.rint(doubled * levels) / levels, (2, 2, 1))))
    si = dr.zeros(mi.SurfaceInteraction3f)
    cos, sin, _ = (np.ravel(x)[0] for x in describe(bsdf).frame(si))
    error = np.degrees(np.angle(np.exp(1j * (np.arctan2(sin, cos) - angle))))
    assert abs(error) < PRECISION[bits] + 2e-5  # the angle in single precision
    assert f"within {PRECISION[8]:.2g}° in 8 bits" in str(bsdf)


def test_the_middle_of_a_picture_of_8_bits_turns_nothing(some_variant):
    bsdf = load(orientation=bitmap(np.full((2, 2, 3), 128 / 255)))
    cos, sin, _ = (np.ravel(x)[0] for x in describe(bsdf).frame(dr.zeros(mi.SurfaceInteraction3f)))
    assert (cos, sin) == (1.0, 0.0)


@pytest.mark.parametrize("degrees", [1e30, -40_000.0])
def test_angles_without_digits_are_refused(every_variant, degrees):
    assert "at least -36000° and at most 36000°" in refusal(lambda: load(orientation=degrees))


@pytest.mark.thorough
def test_vcavity_is_its_formula_and_none_is_the_default(some_variant):
    wi, wo, lam = pairs(500)
    plain, shadowed = (
        evaluated(load(**given), wi, wo, lam[:, None]) for given in ({}, {"shadowing": "vcavity"})
    )
    half = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    across = np.sum(wo * half, axis=1)
    factor = np.minimum(1.0, 2.0 * half[:, 2] * np.minimum(wi[:, 2], wo[:, 2]) / across)
    assert factor.min() < 0.5  # or the test would say little
    # order 0 is a mirror's lobe, which grooves do not shadow; of 4.5 µm it reaches 0.5
    others = np.hypot(*(wi + wo)[:, :2].T) > 0.5
    expected = (plain * factor[:, None])[others]
    assert shadowed[others] == pytest.approx(expected, rel=1e-4, abs=1e-6 * float(plain.max()))


FACTORS = (0.25, 1.25, 0.8, 0.0)
#: What conserves energy takes a second for each of the height scales that it is made at.
GENTLE = {"height_scale": (1.1, 1.25, 1.0, 1.2)}
FILM = {"eta": 0.9, "k": 6.0, "film_ior": 1.6}
#: Numbers of four texels, and other parameters.
CASES = {
    "heights": ({"height_scale": FACTORS}, {}),
    "heights under a coat": ({"height_scale": FACTORS}, {"material": "Al", "coat_ior": 1.3}),
    "heights, scaled energy": (GENTLE, {"energy_conserving": True}),
    "heights over pigment": ({"height_scale": FACTORS}, {"int_ior": 1.5, "pigment": "grey"}),
    "lengths": ({"lateral_scale": (0.6, 1.3, 0.8, 1.0)}, {}),
    "directions": ({"orientation": (0.0, 90.0, 200.0, 40.0)}, {}),
    "films": ({"film_thickness": (100.0, 400.0, 200.0, 300.0)}, FILM),
}


def texture(name, numbers):
    """The parameter as a texture of four texels."""
    if name == "orientation":
        return {name: directions(numbers)}
    texels = np.reshape(numbers, (2, 2)).astype(np.float32)
    if name == "film_thickness":
        return {name: bitmap(texels / 400.0), "film_thickness_max": 400.0}
    return {name: bitmap(texels)}


@pytest.mark.thorough
@pytest.mark.usefixtures("mono")
@pytest.mark.parametrize("case", CASES)
def test_each_place_is_as_with_the_number_that_it_has(case):
    varied, fixed = CASES[case]
    ((name, numbers),) = varied.items()
    wi, wo, _ = pairs(60)
    varying = load(**texture(name, numbers), **fixed)
    # lengths share a table where both have one largest factor
    largest = {"lateral_scale_max": max(numbers)} if name == "lateral_scale" else {}
    for number, uv in zip(numbers[:2], UV, strict=False):
        constant = load(**{name: number}, **largest, **fixed)
        found = [
            bsdf.eval_pdf(mi.BSDFContext(), hits(wi, uv), vectors(wo))
            for bsdf in (varying, constant)
        ]
        dr.eval(found)  # one kernel instead of four
        (value, density), (expected, its) = ([np.array(a).ravel() for a in one] for one in found)
        # two tables of the same orders, for other κ, and energies made at other height scales
        assert value == pytest.approx(expected, rel=0.02, abs=2e-3 * float(expected.max()))
        assert density == pytest.approx(its, rel=0.05, abs=0.02 * float(its.max()))


@pytest.mark.thorough
@pytest.mark.usefixtures("mono")
def test_worn_smooth_it_is_a_mirror():
    bsdf = load(**texture("height_scale", FACTORS))
    si = hits(np.array([polar(0.0)]), UV[3])
    up, aside = (bsdf.eval(mi.BSDFContext(), si, vectors(polar(a)))[0][0] for a in (0.0, 20.0))
    assert aside < 1e-6 * up


@pytest.mark.thorough
@pytest.mark.usefixtures("mono")
@pytest.mark.parametrize(
    ("name", "channels", "values", "number"),
    [("height_scale", 1, [0.5] * 3, 0.5), ("orientation", 3, [0.0, 1.0, 0.0] * 3, 90.0)],
)
def test_a_mesh_attribute_is_read(name, channels, values, number):
    attribute, props = {"type": "mesh_attribute", "name": "vertex_worn"}, mi.Properties()
    largest = {"height_scale_max": 1.0} if name == "height_scale" else {}
    props["bsdf"] = load(**{name: attribute}, **largest)
    mesh = mi.Mesh("plate", 3, 1, has_vertex_texcoords=True, props=props)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [0, 0, 0, 4, 0, 0, 0, 4, 0]
    parameters["vertex_texcoords"] = [0, 0, 1, 0, 0, 1]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    mesh.add_attribute("vertex_worn", channels, values)
    scene = mi.load_dict({"type": "scene", "plate": mesh})
    si = scene.ray_intersect(mi.Ray3f([1.0, 1.0, 1.0], [0.0, 0.0, -1.0]))
    si.wi = mi.Vector3f(polar(30.0, 20.0).tolist())
    for azimuth in (200.0, 230.0):
        wo = mi.Vector3f(polar(25.0, azimuth).tolist())
        found = mesh.bsdf().eval(mi.BSDFContext(), si, wo)[0][0]
        constant = load(**{name: number}).eval(mi.BSDFContext(), si, wo)[0][0]
        assert found == pytest.approx(constant, rel=0.01)  # two tables of the same orders


@pytest.mark.thorough
@pytest.mark.usefixtures("mono")
def test_steep_light_within_is_that_of_stretched_heights(mono):
    """Sums of directions reach further than tables do, whatever the factor."""
    factor, rng = 0.65, np.random.default_rng(5)
    patch = md.HeightField(0.1 * rng.random((12, 12)), 0.1, periodic=True)
    parameters = {"plugin": "diffraction_dielectric", "int_ior": 2.5, "ext_ior": 1.0}
    parameters |= {"energy_conserving": False, "model": "kirchhoff"}
    given, made = (
        mi.load_dict(md.bsdf_dict(heights, **parameters, **more))
        for heights, more in (
            (patch, {"lateral_scale": factor, "coherence_width": 1.2}),
            (patch.stretched(factor), {"coherence_width": 1.2 * factor}),
        )
    )
    wi, wo = rng.standard_normal((2, 500, 3)) * (1.0, 1.0, 0.5)
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    wi[:, 2] = -np.abs(wi[:, 2])
    sums = 2.5 * np.linalg.norm((wi + wo)[wo[:, 2] < 0.0][:, :2], axis=1)
    assert np.sum((sums > 2.0) & (sums < 2.0 / factor)) > 20
    values = [evaluated(bsdf, wi, wo, 550.0) for bsdf in (given, made)]
    # both tables have a relative error of 1e-3 of the mean power
    np.testing.assert_allclose(*values, rtol=0.02, atol=2e-3 * values[1].max())


@pytest.mark.thorough
@pytest.mark.usefixtures("mono")
@pytest.mark.parametrize(
    ("loaded", "factor", "largest"),
    [
        ({"lateral_scale": 1.3}, 0.8, 1.3),
        ({"lateral_scale": 0.9, "lateral_scale_max": 1.4}, 1.4, 1.4),
    ],
)
def test_numbers_change_up_to_the_largest(mono, loaded, factor, largest):
    wi, wo, _ = pairs(20)
    bsdf = load(**loaded)
    parameters = mi.traverse(bsdf)
    parameters["lateral_scale"] = factor
    parameters.update()
    anew = load(PATCH.stretched(factor), coherence_width=WIDTH * factor / largest)
    expected, values = (evaluated(one, wi, wo, 550.0) for one in (anew, bsdf))
    # two tables, of the same tolerance
    assert values == pytest.approx(expected, rel=0.05, abs=2e-3 * float(expected.max()))
    parameters["lateral_scale"] = largest + 0.01
    with pytest.raises(DiffractionError, match=rf"at most {largest}, the table.s range"):
        parameters.update()


@pytest.mark.thorough
@pytest.mark.usefixtures("mono")
@pytest.mark.parametrize("factor", [1.1, 1.2, 1.6, 1.7, 2.2])
def test_numbers_above_1_load(mono, factor):
    """Their double is below their single precision, or above it."""
    assert mi.traverse(load(lateral_scale=factor))["lateral_scale"] == mi.Float(factor)


ON_SURFACE = {"coherence": "surface", "uv_scale": 10.0}


def values_at(bsdf, wi, wo, lam, uv, v_axis=1.0):
    """f of one wavelength a pair (n,), at UV coordinates (n, 2), where v runs along ±t."""
    si = interaction(wi, lam[:, None])
    si.uv = mi.Point2f(*(np.ascontiguousarray(c, np.float32) for c in np.transpose(uv)))
    si.dp_du, si.dp_dv = mi.Vector3f(0.01, 0, 0), mi.Vector3f(0, 0.01 * v_axis, 0)
    found = spectra(bsdf.eval(mi.BSDFContext(), si, vectors(wo)))
    return found[np.arange(len(lam)), np.arange(len(lam)) % 4] / wo[:, 2]


def places(n, seed=0):
    """UV coordinates, exact in single precision."""
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (n, 2)).astype(np.float32).astype(float)


def relative(found, exact, light, near):
    """Σ|f − exact| / Σ exact of ⟨|P|²⟩ near order 0 and elsewhere, as the tolerance has it."""
    factor = kirchhoff_factor(*light, sigma_of(WIDTH))
    difference, size = np.abs(found - exact) / factor, exact / factor
    return [difference[m].sum() / size[m].sum() for m in (near, ~near)]


@pytest.mark.thorough
@pytest.mark.parametrize("taps", [None, 12])
def test_places_follow_scale_orientation_and_the_side_that_v_runs_to(variant, taps, tmp_path):
    wi, wo, lam, near = lit_pairs(PATCH, sigma_of(WIDTH), 200, 3)
    table = md.DiffractionTable.build(PATCH, coherence_width=WIDTH, coherence="patch", taps=taps)
    table.save(tmp_path / "patch.exr")
    turned = {"orientation": 90.0, "coherence": "surface", "uv_scale": "10, 20"}
    bsdf = mi.load_dict(
        {"type": "diffraction", "filename": str(tmp_path / "patch.exr"), "material": "none",
         "energy_conserving": False, **turned}
    )  # fmt: skip
    uv = places(200)
    # at 90° the patch's x is t, which v runs against, and its y is −s
    place = np.stack([-20.0 * uv[:, 1], -10.0 * uv[:, 0]], axis=1)
    to_patch = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    frame = (wi @ to_patch, wo @ to_patch, lam)
    exact = md.reference.brdf(
        PATCH, *frame, coherence_width=WIDTH, coherence="surface", place=place
    )
    found = values_at(bsdf, wi, wo, lam, uv, v_axis=-1.0)
    assert max(relative(found, exact, frame, near)) < 1e-3


@pytest.mark.thorough
def test_positions_in_the_world_are_those_of_uv_where_these_are_even(variant):
    wi, wo, lam, _ = lit_pairs(PATCH, sigma_of(WIDTH), 100, 3)
    uv = places(100)
    by_uv = values_at(load(**ON_SURFACE), wi, wo, lam, uv)
    world = load(coherence="surface", world_scale=1000.0)  # dp_du is 0.01
    # single precision: 1e-6 of 30 µm are 1e-4 rad between orders of a window
    assert values_at(world, wi, wo, lam, uv) == pytest.approx(
        by_uv, rel=1e-2, abs=1e-4 * by_uv.max()
    )


def grain():
    """Gaussian noise, 16 µm wide, whose speckle away from the mirror direction is Gaussian too."""
    noise = np.fft.fft2(np.random.default_rng(4).normal(size=(128, 128)))
    q = 2 * np.pi * np.fft.fftfreq(128, 0.125)
    smooth = np.exp(-0.25 * 0.3**2 * (q[:, None] ** 2 + q**2))
    heights = np.fft.ifft2(noise * smooth).real
    return md.HeightField(heights * (0.02 / heights.std()), 0.125)


@pytest.mark.thorough
@pytest.mark.parametrize("tiling", ["periodic", "random"])
def test_the_mean_is_the_ensemble_s_and_the_contrast_that_of_independent_windows(variant, tiling):
    given = {"coherence_width": 3.0, "tolerance": 3e-3}
    directions, each = 300, 256
    rng = np.random.default_rng(5)
    wi, wo = uniform_directions(directions, rng, 0.5), uniform_directions(directions, rng, 0.5)
    off = np.hypot(*(wi + wo)[:, :2].T) > 0.6  # of the mirror direction, by 9 of the lobe's widths
    wi, wo = wi[off], wo[off]
    lam = rng.uniform(400.0, 700.0, len(wi))
    mean = values_at(load(grain(), **given), wi, wo, lam, np.zeros((len(wi), 2)))
    many = (np.repeat(part, each, axis=0) for part in (wi, wo, lam))
    uv = rng.uniform(0.0, 1600.0, (len(wi) * each, 2))  # 1000 × 1000 patches
    found = values_at(load(grain(), **given, **ON_SURFACE, tiling=tiling), *many, uv)
    relative = found.reshape(-1, each) / mean[:, None]
    # 70 000 places, of a deviation of 1 each: a standard error of 0.004
    assert relative.mean() == pytest.approx(1.0, abs=0.01)
    for n in (1, 4, 16):
        contrast = relative.reshape(len(wi), -1, n).mean(axis=2).std()
        assert contrast == pytest.approx(1 / np.sqrt(n), rel=0.05)


@pytest.mark.thorough
def test_random_tiles_do_not_repeat_and_periodic_ones_do(mono):
    wi, wo, _, _ = lit_pairs(PATCH, sigma_of(WIDTH), 100, 3)
    here, again = hits(wi, places(100)), hits(wi, places(100) + np.array(PATCH.extent) / 10.0)
    for tiling, alike in (("periodic", True), ("random", False)):
        bsdf = load(**ON_SURFACE, tiling=tiling)
        one, other = (
            np.array(bsdf.eval(mi.BSDFContext(), si, vectors(wo))[0]) for si in (here, again)
        )
        assert np.allclose(one, other, rtol=1e-2, atol=1e-4 * one.max()) == alike


@pytest.mark.thorough
def test_directions_and_albedo_are_those_of_the_mean(mono):
    wi, wo, _, _ = lit_pairs(PATCH, sigma_of(WIDTH), 100, 3)
    given = {"int_ior": 1.5, "pigment": {"type": "diffuse"}}
    both = [load(**one | given) for one in (ON_SURFACE, {})]
    si, context = hits(wi, places(100)), mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, 0)
    one, other = (np.array(bsdf.pdf(context, si, vectors(wo))) for bsdf in both)
    # two tables of the same orders, each to its tolerance; cells have 8 bits
    assert one == pytest.approx(other, rel=0.02, abs=1e-3 * float(other.max()))
    one, other = (bsdf.describe().albedo_excess(1.0).values for bsdf in both)
    assert one == pytest.approx(other, rel=2e-3, abs=1e-4)
