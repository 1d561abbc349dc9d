"""Functions of `dr.freeze` follow what changes: parameters, patches, scenes."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.lanes import interaction, lanes, vectors
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

# coarse pixels keep the tables small; that is not the point here
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]


@pytest.mark.parametrize("name", ["llvm_ad_rgb", "llvm_ad_mono", "cuda_ad_rgb"])
def test_frozen_rendering_follows_its_parameters(name):
    backend = dr.JitBackend.CUDA if name.startswith("cuda") else dr.JitBackend.LLVM
    if not dr.has_backend(backend):
        pytest.skip(f"{name}: Dr.Jit finds no device for it")
    mi.set_variant(name)
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
    texture = mi.TensorXf(np.full((2, 2, 3), 0.61, np.float32))
    surfaces = [
        diffraction(energy_conserving=True, lateral_scale=1.0),
        diffraction(OTHER),
        diffraction(
            OTHER, coherence="patch", orientation={"type": "bitmap", "raw": True, "data": texture}
        ),
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
