"""Parameters that vary over a surface, and `lateral_scale`; what orientations refuse; shadowing."""

from __future__ import annotations

import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.plugin.varying import PRECISION
from tests.support.directions import polar
from tests.support.gentle import PATCH, UV, WIDTH, directions, hits, load, pairs
from tests.support.lanes import bitmap, evaluated, refusal, vectors


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
