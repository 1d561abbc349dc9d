"""Inside other plugins: wrapped, instanced, several in a scene, recorded, and loaded many times."""

from __future__ import annotations

import gc
import resource
import weakref
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.lanes import evaluated, interaction, spectra, vectors
from tests.optics import Array, as_single, polar, rough_patch, uniform_directions

# coarse pixels keep the tables small; that is not the point here
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")

PATCH = rough_patch((48, 50), (0.1, 0.1), 0.12)
OTHER = rough_patch((40, 44), (0.12, 0.1), 0.3, seed=2)
RAW = {"coherence_width": 5.0, "energy_conserving": False, "material": "none"}
WAVELENGTHS = [[400.0, 480.0, 560.0, 700.0]]


def diffraction(field: md.HeightField = PATCH, **parameters: Any) -> dict[str, Any]:
    return md.bsdf_dict(field, **(RAW | parameters))


def load(kind: str, **parameters: Any) -> Any:
    return mi.load_dict({"type": kind, **parameters})


def pairs(n: int = 300, seed: int = 0) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return uniform_directions(n, rng, 0.3), uniform_directions(n, rng, 0.3)


def grey(value: float, **parameters: Any) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "uniform", "value": value}, **parameters}


def assert_consistent(bsdf: Any, si: Any) -> None:
    """`sample` draws what `eval` and `pdf` say."""
    rng = mi.PCG32(dr.width(si))
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    sample, weight = bsdf.sample(mi.BSDFContext(), si, *numbers)
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, sample.wo)
    drawn = (np.array(sample.pdf) > 0.0) & (np.array(pdf) > 0.0)
    assert np.mean(drawn) > 0.5
    # Mitsuba's maps keep the density of what would go through the surface, but no light
    assert np.all(spectra(weight)[~drawn] == 0.0)
    # the same expressions in another kernel, in single precision
    assert np.array(sample.pdf)[drawn] == pytest.approx(np.array(pdf)[drawn], rel=1e-3)
    product = (spectra(weight) * np.array(sample.pdf)[:, None])[drawn]
    value = spectra(value)[drawn]
    assert product == pytest.approx(value, rel=2e-3, abs=1e-5 * value.max())


# ------------------------------------------------------------------------ other BSDFs around it


def test_a_blend_is_the_weighted_sum(variant):
    wi, wo = pairs()
    blend = load("blendbsdf", weight=0.3, one=diffraction(), two=diffraction(OTHER))
    parts = [evaluated(mi.load_dict(diffraction(f)), wi, wo, WAVELENGTHS) for f in (PATCH, OTHER)]
    expected = 0.7 * parts[0] + 0.3 * parts[1]
    assert evaluated(blend, wi, wo, WAVELENGTHS) == pytest.approx(expected, rel=1e-5)


def test_a_mask_lets_the_rest_through(variant):
    wi, wo = pairs()
    masked = load("mask", opacity=0.25, nested=diffraction())
    expected = 0.25 * evaluated(mi.load_dict(diffraction()), wi, wo, WAVELENGTHS)
    assert evaluated(masked, wi, wo, WAVELENGTHS) == pytest.approx(expected, rel=1e-5)
    si = interaction(wi, WAVELENGTHS)
    transmitted = np.array(masked.eval_null_transmission(si)).T
    assert np.broadcast_to(transmitted, (300, 4)) == pytest.approx(0.75, rel=1e-6)


@pytest.mark.parametrize("theta", [0.0, 20.0])
@pytest.mark.parametrize("kind", ["normalmap", "bumpmap"])
def test_on_a_tilted_frame_it_sees_tilted_directions(variant, kind, theta):
    """A map that tilts the frame towards +x by θ everywhere turns the directions back by θ."""

    def tilt(nested: dict[str, Any]) -> Any:
        if kind == "normalmap":
            normal = (0.5 + 0.5 * polar(theta)).astype(np.float32)
            texture = mi.TensorXf(np.tile(normal, (2, 2, 1)))
            how = {"normalmap": {"type": "bitmap", "raw": True, "data": texture}}
        else:
            ramp = np.linspace(0.0, 1.0, 64, dtype=np.float32)
            texture = mi.TensorXf(np.tile(ramp[:, None], (64, 1, 1)))
            # the ramp rises between the middles of the first and the last pixel
            scale = -float(np.tan(np.radians(theta))) * 63 / 64
            how = {"texture": {"type": "bitmap", "raw": True, "data": texture}, "scale": scale}
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


# ------------------------------------------------------------------------ scenes


def scene(*shapes: dict[str, Any], size: int = 12, **parameters: Any) -> Any:
    """Shapes under one lamp and a sky, seen from above."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "fov": 40,
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=[0.0, 0.0, 4.0], target=[0, 0, 0], up=[0, 1, 0]
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "rfilter": {"type": "box"},
                },
            },
            "sky": {"type": "constant", "radiance": 0.3},
            "lamp": {"type": "directional", "direction": [0.1, 0.3, -1.0], "irradiance": 1.0},
            **{f"shape {n}": shape for n, shape in enumerate(shapes)},
            **parameters,
        }
    )


def plate(bsdf: Any, x: float = 0.0, **parameters: Any) -> dict[str, Any]:
    """A plate 1.2 wide at x."""
    place = mi.ScalarTransform4f().translate([x, 0, 0]).scale([0.6, 1.2, 1.0])
    return {"type": "rectangle", "bsdf": bsdf, "to_world": place, **parameters}


def rendered(scene: Any, spp: int = 64, seed: int = 0) -> Array:
    return np.array(mi.render(scene, spp=spp, seed=seed), float)


def test_wrappers_that_do_nothing_change_no_picture(variant):
    blend = {"type": "blendbsdf", "weight": 0.0, "one": diffraction(), "two": grey(0.5)}
    wrapped = {"type": "mask", "opacity": 0.999999, "in": {"type": "twosided", "in": blend}}
    plain, wrapped = (rendered(scene(plate(b)), 256) for b in (diffraction(), wrapped))
    # other random numbers reach it through the mask and the blend: means over all pixels
    scale = plain.mean()
    assert wrapped.mean(axis=(0, 1)) == pytest.approx(plain.mean(axis=(0, 1)), abs=0.03 * scale)


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


# ------------------------------------------------------------------------ recorded functions


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
    texture = mi.TensorXf(np.full((2, 2, 3), 0.6, np.float32))
    surfaces = [
        diffraction(energy_conserving=True),
        diffraction(OTHER),
        diffraction(
            OTHER, coherence="patch", orientation={"type": "bitmap", "raw": True, "data": texture}
        ),
    ]
    for surface in surfaces:
        bsdf = mi.load_dict(surface)
        parameters = mi.traverse(bsdf)
        for n, scale in enumerate((1.0, 0.9, 0.7)):
            parameters["height_scale"] = scale
            parameters.update()
            wi, wo = pairs(seed=n)
            si, wo = interaction(wi, WAVELENGTHS), vectors(wo)
            rng = np.random.default_rng(n)
            one = mi.Float(rng.random(300).astype(np.float32))
            two = mi.Point2f(rng.random((2, 300)).astype(np.float32))
            dr.eval(si, wo, one, two)
            expected = [*bsdf.eval_pdf(context, si, wo), *bsdf.sample(context, si, one, two)]
            found = [*evaluate(bsdf, si, wo), *draw(bsdf, si, one, two)]
            expected[2:3], found[2:3] = (
                [expected[2].wo, expected[2].pdf],
                [found[2].wo, found[2].pdf],
            )
            for a, b in zip(found, expected, strict=True):
                a, b = np.array(a, float), np.array(b, float)
                assert a == pytest.approx(b, rel=1e-4, abs=1e-5 * np.abs(b).max())


# ------------------------------------------------------------------------ memory


LOADED = ("scalar_spectral", "llvm_ad_spectral", "llvm_ad_rgb", "llvm_ad_mono")


@pytest.mark.parametrize("name", LOADED)
def test_what_is_no_longer_used_is_let_go(name):
    if name.startswith("llvm") and not dr.has_backend(dr.JitBackend.LLVM):
        pytest.skip(f"{name}: Dr.Jit finds no device for it")
    mi.set_variant(name)
    bsdf = mi.load_dict(diffraction(energy_conserving=True))
    si, sampled = dr.zeros(mi.SurfaceInteraction3f), (0.4, mi.Point2f(0.3, 0.6))
    si.wi = mi.Vector3f(0.1, 0.2, 0.97)
    if mi.is_spectral:
        si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    dr.eval(bsdf.sample(mi.BSDFContext(), si, *sampled))
    table = weakref.ref(bsdf.table)
    del bsdf
    gc.collect()
    assert table() is None


def resident() -> float:
    """Memory in use, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def test_scenes_loaded_many_times_do_not_grow_memory(variant):
    if not Path("/proc/self/statm").is_file():
        pytest.skip("no /proc here to read the memory in use from")
    # large enough to be seen: 2 MB of coefficients and as much again of proposals
    fields = [rough_patch((300, 300), (0.1, 0.1), 0.1 + 0.01 * n, seed=n) for n in range(5)]
    size = 0.0
    for n in range(44):
        loaded = scene(plate(diffraction(fields[n % 5], coherence_width=25.0)), size=4)
        rendered(loaded, 4)
        size = max(size, loaded.shapes()[0].bsdf().table.nbytes / 1e6)
        del loaded
        gc.collect()
        if n == 17:  # all tables built, all kernels compiled, all pools of memory filled
            before = resident()
    assert size > 1.0  # or the test would say little
    # 26 leaked tables would be 26 times that, without their proposals and copies; the allocator
    # alone is seen to keep 8 MB in a process that has run many other tests
    assert resident() - before < 10.0 * size
