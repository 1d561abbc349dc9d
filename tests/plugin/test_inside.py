"""Inside other plugins and functions of `dr.freeze`: wrapped, tilted, instanced, several."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import as_single, polar
from tests.support.lanes import bitmap, evaluated, interaction, lanes, spectra, vectors
from tests.support.plates import (
    OTHER,
    PATCH,
    RAW,
    WAVELENGTHS,
    diffraction,
    grey,
    pairs,
    plate,
    rendered,
    scene,
)
from tests.support.variants import use

pytestmark = pytest.mark.thorough


def load(kind: str, **parameters: Any) -> Any:
    return mi.load_dict({"type": kind, **parameters})


def assert_consistent(bsdf: Any, si: Any) -> None:
    """`sample` draws what `eval` and `pdf` say."""
    rng = mi.PCG32(dr.width(si))
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    sample, weight = bsdf.sample(mi.BSDFContext(), si, *numbers)
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, sample.wo)
    dr.eval(sample, weight, value, pdf)  # one kernel instead of four
    drawn = (np.array(sample.pdf) > 0.0) & (np.array(pdf) > 0.0)
    assert np.mean(drawn) > 0.5
    # Mitsuba's maps keep the density of what would go through the surface, but no light
    assert np.all(spectra(weight)[~drawn] == 0.0)
    # the same expressions in single precision
    assert np.array(sample.pdf)[drawn] == pytest.approx(np.array(pdf)[drawn], rel=1e-3)
    product = (spectra(weight) * np.array(sample.pdf)[:, None])[drawn]
    value = spectra(value)[drawn]
    assert product == pytest.approx(value, rel=2e-3, abs=1e-5 * value.max())


def test_a_blend_is_the_weighted_sum(variant):
    wi, wo = pairs()
    blend = load("blendbsdf", weight=0.3, one=diffraction(), two=diffraction(OTHER))
    parts = [evaluated(mi.load_dict(diffraction(f)), wi, wo, WAVELENGTHS) for f in (PATCH, OTHER)]
    expected = 0.7 * parts[0] + 0.3 * parts[1]
    assert evaluated(blend, wi, wo, WAVELENGTHS) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("theta", [0.0, 20.0])
@pytest.mark.parametrize("kind", ["normalmap", "bumpmap"])
def test_on_a_tilted_frame_it_sees_tilted_directions(variant, kind, theta):
    """A map that tilts the frame towards +x by θ everywhere turns the directions back by θ."""

    def tilt(nested: dict[str, Any]) -> Any:
        if kind == "normalmap":
            how = {"normalmap": bitmap(np.tile(0.5 + 0.5 * polar(theta), (2, 2, 1)))}
        else:
            ramp = bitmap(np.tile(np.linspace(0.0, 1.0, 64), (64, 1)), filter_type="bilinear")
            # the ramp rises between the middles of the first and the last pixel
            scale = -float(np.tan(np.radians(theta))) * 63 / 64
            how = {"texture": ramp, "scale": scale}
        return load(kind, nested=nested, **how)

    tilted, tilted_white = tilt(diffraction()), tilt(grey(1.0))
    wi, wo = pairs()
    angle = np.radians(theta)
    back = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    turned_i, turned_o = as_single(wi @ back.T), as_single(wo @ back.T)
    above = (turned_i[:, 2] > 0.05) & (turned_o[:, 2] > 0.05)
    wi, wo, turned_i, turned_o = (d[above] for d in (wi, wo, turned_i, turned_o))
    si = interaction(wi, WAVELENGTHS)
    si.uv = mi.Point2f(0.5, 0.5)
    si.n = mi.Normal3f(0, 0, 1)
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    value, white = (
        spectra(b.eval(mi.BSDFContext(), si, vectors(wo))) for b in (tilted, tilted_white)
    )
    # the maps darken what the true surface would hide, whatever they hold: by as much as white
    darkened = white / (turned_o[:, 2:] / np.pi)
    assert np.all((darkened > 0.5) & (darkened < 1.0 + 1e-5))
    expected = evaluated(mi.load_dict(diffraction()), turned_i, turned_o, WAVELENGTHS) * darkened
    # slopes in single precision, against lobes 40 mrad wide
    assert np.sum(np.abs(value - expected)) < 1e-4 * np.sum(expected)
    assert_consistent(tilted, si)


def test_instances_look_like_what_they_are_instances_of(variant):
    turn = mi.ScalarTransform4f().rotate([0, 0, 1], 30)
    place = turn @ mi.ScalarTransform4f().scale([0.9, 0.9, 1.0])
    plain = scene({"type": "rectangle", "to_world": place, "bsdf": diffraction()})
    group = {"type": "shapegroup", "inner": {"type": "rectangle", "bsdf": diffraction()}}
    instance = {"type": "instance", "shapegroup": {"type": "ref", "id": "group"}}
    instanced = scene(instance | {"to_world": place}, group=group)
    one, other = rendered(plain), rendered(instanced)
    assert other == pytest.approx(one, rel=1e-3, abs=1e-3 * one.max())  # single precision


def test_each_of_several_surfaces_keeps_its_own_patch(variant):
    bsdfs = [
        diffraction(),
        diffraction(OTHER, material="Au", orientation=40.0),
    ]
    places = (-0.8, 0.8)
    together = scene(*(plate(b, x) for b, x in zip(bsdfs, places, strict=True)), size=24)
    alone = [scene(plate(b, x), size=24) for b, x in zip(bsdfs, places, strict=True)]
    whole, parts = rendered(together), [rendered(s) for s in alone]
    # the left plate's half of the picture, and the right one's; nothing lies on the other side
    expected = np.concatenate([parts[0][:, :12], parts[1][:, 12:]], axis=1)
    assert np.abs(parts[0] - parts[1]).max() > 0.1 * whole.max()
    assert whole == pytest.approx(expected, rel=1e-3, abs=1e-4 * whole.max())  # single precision


@pytest.mark.parametrize("name", ["llvm_ad_rgb", "llvm_ad_mono", "cuda_ad_rgb"])
def test_frozen_rendering_follows_its_parameters(name):
    use(name)
    conserving = {"energy_conserving": True, "wavelength": 600.0}
    coated = {"material": None, "int_ior": 1.5, "pigment": grey(0.4)}
    coated = {k: v for k, v in (RAW | conserving | coated).items() if v is not None}
    scenes = [
        scene(plate(diffraction(**conserving))),
        scene(plate(diffraction(OTHER, **conserving))),  # the same arrays, other numbers
    ]
    if mi.is_rgb:
        scenes.append(scene(plate(md.bsdf_dict(PATCH, **coated))))
    frozen = dr.freeze(lambda scene, seed: mi.render(scene, spp=16, seed=seed))
    for one in scenes:
        parameters = mi.traverse(one)
        prefix = next(k for k in dict(parameters) if k.endswith("height_scale"))
        prefix = prefix.removesuffix("height_scale")
        for scale, degrees in ((1.0, 0.0), (0.9, 20.0), (0.92, 90.0)):
            parameters[f"{prefix}height_scale"] = scale
            parameters[f"{prefix}orientation"] = degrees
            parameters.update()
            expected = rendered(one, 16)
            found = np.array(frozen(one, mi.UInt32(0)), float)
            assert found == pytest.approx(expected, rel=1e-4, abs=1e-5 * expected.max())
    # a recording a scene, and one more where a first value was a literal still
    assert frozen.n_recordings <= 2 * len(scenes)


def test_frozen_eval_and_sample_follow_their_parameters(variant):
    context = mi.BSDFContext()
    evaluate = dr.freeze(lambda bsdf, si, wo: bsdf.eval_pdf(context, si, wo))
    draw = dr.freeze(lambda bsdf, si, one, two: bsdf.sample(context, si, one, two))
    surfaces = [
        diffraction(energy_conserving=True, lateral_scale=1.0),
        diffraction(OTHER),
        diffraction(OTHER, coherence="patch", orientation=bitmap(np.full((2, 2, 3), 0.61))),
    ]
    for surface in surfaces:
        bsdf = mi.load_dict(surface)
        parameters = mi.traverse(bsdf)
        for n, scale in enumerate((1.0, 0.9, 0.7)):
            for name in {"height_scale", "lateral_scale"} & set(dict(parameters)):
                parameters[name] = scale
            parameters.update()
            wi, wo = pairs(seed=n)
            si, wo = interaction(wi, WAVELENGTHS), vectors(wo)
            rng = np.random.default_rng(n)
            one = lanes(rng.random(300))
            two = mi.Point2f(rng.random((2, 300)).astype(np.float32))
            dr.eval(si, wo, one, two)
            expected, found = [*bsdf.eval_pdf(context, si, wo)], [*evaluate(bsdf, si, wo)]
            # Dr.Jit 1.5 ends the process when it records samples of a bitmap on CUDA
            if surface is not surfaces[2] or variant.startswith("llvm"):
                expected += bsdf.sample(context, si, one, two)
                found += draw(bsdf, si, one, two)
            dr.eval(expected)  # one kernel instead of five
            expected[2:3] = [part for drawn in expected[2:3] for part in (drawn.wo, drawn.pdf)]
            found[2:3] = [part for drawn in found[2:3] for part in (drawn.wo, drawn.pdf)]
            for a, b in zip(found, expected, strict=True):
                a, b = np.array(a, float), np.array(b, float)
                assert a == pytest.approx(b, rel=1e-4, abs=1e-5 * np.abs(b).max())


def test_frozen_eval_follows_an_index_into_total_reflection(variant):
    context = mi.BSDFContext()
    evaluate = dr.freeze(lambda bsdf, si, wo: bsdf.eval(context, si, wo))
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, coherence_width=4.0, energy_conserving=False))
    parameters = mi.traverse(bsdf)
    wi, wo = pairs()
    si, wo = interaction(wi, WAVELENGTHS), vectors(wo)
    dr.eval(si, wo)
    for eta in (1.5, 1.3, 0.7, 0.8):
        parameters["eta"] = eta
        parameters.update()
        expected = np.array(bsdf.eval(context, si, wo))
        found = np.array(evaluate(bsdf, si, wo))
        assert found == pytest.approx(expected, rel=1e-4, abs=1e-5 * float(np.abs(expected).max()))
