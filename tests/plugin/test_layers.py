"""Shadowing and orientation of the plugin."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md  # before Mitsuba: it chooses Dr.Jit's LLVM
from tests.support.directions import polar, uniform_directions

import mitsuba as mi  # isort: skip
import drjit as dr  # isort: skip

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("variant"),
]

RAW = {"energy_conserving": False, "coherence_width": 8.0, "tolerance": 2e-3}


def patch() -> md.HeightField:
    """A small periodic patch without symmetries."""
    y, x = np.meshgrid(np.arange(32) * 0.25, np.arange(40) * 0.2, indexing="ij")
    heights = 0.05 * np.cos(np.pi * x / 2) + 0.04 * np.sin(np.pi * (x + y) / 4)
    heights += 0.03 * np.cos(np.pi * y / 2 + 1.0)
    return md.HeightField(heights, (0.2, 0.25))


def plugin(**parameters):
    return mi.load_dict(md.bsdf_dict(patch(), **(RAW | parameters)))


def values(bsdf, wi, wo, **interaction) -> np.ndarray:
    """f cosθo, (4, n)."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi = mi.Vector3f(np.asarray(wi, np.float32).T)
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    for name, value in interaction.items():
        setattr(si, name, value)
    return np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(np.asarray(wo, np.float32).T)))


def pairs(n: int = 500, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return uniform_directions(n, rng), uniform_directions(n, rng)


def test_vcavity_is_its_formula_and_none_is_the_default():
    wi, wo = pairs()
    plain, shadowed = values(plugin(), wi, wo), values(plugin(shadowing="vcavity"), wi, wo)
    half = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    across = np.sum(wo * half, axis=1)
    factor = np.minimum(1.0, 2.0 * half[:, 2] * np.minimum(wi[:, 2], wo[:, 2]) / across)
    assert factor.min() < 0.5  # or the test would say little
    # order 0 is a mirror's lobe, which grooves do not shadow
    others = np.hypot(*(wi + wo)[:, :2].T) > 0.3
    plain, shadowed, factor = plain[:, others], shadowed[:, others], factor[others]
    assert shadowed == pytest.approx(plain * factor, rel=1e-4, abs=1e-6 * float(plain.max()))


def directions_texture(cos: float, sin: float) -> dict:
    data = np.zeros((2, 2, 3), np.float32)
    data[..., 0], data[..., 1] = cos, sin
    return {"type": "bitmap", "raw": True, "data": mi.TensorXf(data)}


def test_a_texture_turns_each_point_its_own_way():
    data = np.zeros((1, 2, 3), np.float32)
    data[0, 0, 0] = data[0, 1, 1] = 1.0  # 0° at the left, 90° at the right
    texture = {"type": "bitmap", "raw": True, "data": mi.TensorXf(data), "filter_type": "nearest"}
    wi, wo = pairs(200)
    bsdf = plugin(orientation=texture)
    for u, degrees in ((0.25, 0.0), (0.75, 90.0)):
        here = values(bsdf, wi, wo, uv=mi.Point2f(u, 0.5))
        constant = values(plugin(orientation=degrees), wi, wo)
        assert here == pytest.approx(constant, rel=1e-3, abs=1e-5 * float(constant.max()))


def test_a_mesh_attribute_orients_the_patch():
    mesh = mi.Mesh("plate", 4, 2, has_vertex_texcoords=True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]
    parameters["vertex_texcoords"] = [0, 0, 1, 0, 1, 1, 0, 1]
    parameters["faces"] = [0, 1, 2, 0, 2, 3]
    parameters.update()
    mesh.add_attribute("vertex_direction", 3, [0.0, 1.0, 0.0] * 4)
    scene = mi.load_dict({"type": "scene", "plate": mesh})
    ray = mi.Ray3f(mi.Point3f(0.6, 0.3, 1.0), mi.Vector3f(0.0, 0.0, -1.0))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si = scene.ray_intersect(ray)
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    si.wi = mi.Vector3f(polar(30.0, 20.0))
    wo = mi.Vector3f(polar(25.0, 230.0))
    attribute = {"type": "mesh_attribute", "name": "vertex_direction"}
    one, other = (
        np.array(plugin(orientation=way).eval(mi.BSDFContext(), si, wo))
        for way in (attribute, 90.0)
    )
    assert one == pytest.approx(other, rel=1e-3)


def test_textured_samples_are_drawn_as_densely_as_pdf_says():
    bsdf = plugin(orientation=directions_texture(0.6, 0.8), material="none")
    n = 20000
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(polar(30.0, 20.0))
    si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    rng = mi.PCG32(n)
    sample, weight = bsdf.sample(
        mi.BSDFContext(), si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    )
    density = bsdf.pdf(mi.BSDFContext(), si, sample.wo)
    dr.eval(sample, weight, density)  # one kernel instead of three
    good = np.array(sample.pdf) > 0
    assert np.array(density)[good] == pytest.approx(np.array(sample.pdf)[good], rel=1e-3)
    # a shallow patch: nearly all power is in few lobes, found only if drawn where `eval` has them
    assert np.array(weight).mean(axis=1) == pytest.approx(1.0, abs=0.1)
