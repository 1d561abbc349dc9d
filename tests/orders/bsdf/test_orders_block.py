"""The BSDF `diffraction_orders` of a block's face: light from outside and from within."""

from __future__ import annotations

import itertools

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.orders.kinds import BLOCK, INDEX, STEP, block_grating, indices
from tests.support.lanes import interaction
from tests.support.orders import load


@pytest.mark.parametrize(
    ("tangential", "within"),
    [(0.4, False), (0.97, False), (0.4, True), (0.97, True), (1.2, True), (1.45, True)],
)
def test_samples_are_orders_in_their_directions_and_keep_all_light(
    some_variant, tangential, within
):
    n, rng = 4000, np.random.default_rng(1)
    came = INDEX if within else 1.0
    x = tangential / came
    wi = np.tile([x, 0.0, np.sqrt(1.0 - x * x) * (-1.0 if within else 1.0)], (n, 1))
    light = np.full((n, 4), 550.0)
    bsdf = load(BLOCK, coherence_width=500.0)
    for mode in (mi.TransportMode.Radiance, mi.TransportMode.Importance):
        numbers = mi.Float(rng.random(n)), mi.Point2f(rng.random((2, n)))
        sample, weight = bsdf.sample(mi.BSDFContext(mode), interaction(wi, light), *numbers)
        wo, weight, eta = np.array(sample.wo).T, np.array(weight)[0], np.array(sample.eta)
        lit = weight > 0.0
        # all but samples of lobes that reach beyond grazing
        assert lit.mean() > 0.98
        wo, weight, eta = wo[lit], weight[lit], eta[lit]
        left = indices(BLOCK, wo)[:, 0]
        order = (left * wo[:, 0] + came * x) / STEP
        # lobes of 500 µm are 1e-3 wide
        assert np.abs(order - np.round(order)).max() < 5e-3
        assert eta == pytest.approx(left / came, rel=1e-6)
        scale = (came / left) ** 2 if mode == mi.TransportMode.Radiance else np.ones(len(left))
        # half floats
        assert weight == pytest.approx(scale, rel=5e-3)
        assert (wo[:, 2] > 0.0).any() == (tangential < 1.0 or tangential - STEP > -1.0)


#: Thickness of a plate, and the middle of its gratings, 1.6 long, in cm.
THICK, PLACES = 0.5, (-3.0, 3.0)
#: 9 % of a beam along the normal goes into each guided order, and as much of that out again.
COUPLER = block_grating(strength=0.05, zeroth=0.4)


def plate(out=True):
    """A plate with a grating on its upper face, and, if `out`, another one."""
    clear = {"type": "dielectric", "int_ior": INDEX, "ext_ior": 1.0}
    grating = md.bsdf_dict(COUPLER, coherence_width=300.0)

    def face(z, first, last, bsdf, up=True):
        to_world = mi.ScalarTransform4f().translate([0.5 * (first + last), 0.0, z])
        to_world = to_world.scale([0.5 * (last - first), 4.0, 1.0])
        to_world = to_world if up else to_world.rotate([1, 0, 0], 180)
        return {"type": "rectangle", "to_world": to_world, "bsdf": bsdf}

    ends = [-8.0, *(x + half for x in PLACES for half in (-0.8, 0.8)), 8.0]
    faces = {"below": face(-THICK, -8.0, 8.0, clear, up=False)}
    for n, (first, last) in enumerate(itertools.pairwise(ends)):
        faces[f"top{n}"] = face(0.0, first, last, grating if n == 1 or (n == 3 and out) else clear)
    return faces


def leaving(scene, n=100_000, length=12):
    """Places and directions (n, 3) in which a beam above the first grating leaves a plate."""
    rng = np.random.default_rng(1)
    ray = dr.zeros(mi.Ray3f, n)
    ray.o, ray.d, ray.maxt = mi.Point3f(PLACES[0], 0.0, 2.0), mi.Vector3f(0.0, 0.0, -1.0), np.inf
    ray.wavelengths = mi.Color0f(0.0) if not mi.is_spectral else mi.Spectrum(550.0)
    context = mi.BSDFContext(mi.TransportMode.Importance)
    for _ in range(length):
        si = scene.ray_intersect(ray)
        numbers = mi.Float(rng.random(n)), mi.Point2f(rng.random((2, n)))
        sample, weight = si.bsdf().sample(context, si, *numbers, si.is_valid())
        going = si.is_valid()
        lit = mi.unpolarized_spectrum(weight)[0] > 0.0
        onward = si.spawn_ray(si.to_world(sample.wo))
        ray.o, ray.d = dr.select(going, onward.o, ray.o), dr.select(going, onward.d, ray.d)
        ray.d = dr.select(going & ~lit, mi.Vector3f(0.0), ray.d)
        dr.eval(ray)
    out = ~scene.ray_test(ray)
    return np.array(ray.o).T[np.array(out)], np.array(ray.d).T[np.array(out)]


def test_a_guided_order_stays_within_a_plate_until_it_meets_another_grating(some_variant):
    into = float(COUPLER.efficiency(0.0, 0.0, 550.0, 1, transmitted=True))
    # out again, along the normal
    out = float(COUPLER.efficiency(STEP, 0.0, 550.0, -1, from_below=True, transmitted=True))
    assert 0.05 < out == pytest.approx(into, rel=1e-4)
    n = 100_000
    for present in (True, False):
        places, directions = leaving(mi.load_dict({"type": "scene", **plate(present)}), n)
        upwards = (places[:, 0] > 0.0) & (abs(places[:, 2]) < 1e-3) & (directions[:, 2] > 0.0)
        if not present:
            assert not upwards.any()
            continue
        # the fourth reflection, at x = 4 · 2 · 0.5 cm tanθ with n sinθ = 1.222
        hop = 2.0 * THICK * STEP / np.sqrt(INDEX**2 - STEP**2)
        assert np.median(places[upwards, 0]) == pytest.approx(PLACES[0] + 4.0 * hop, abs=0.05)
        assert np.median(directions[upwards, 2]) == pytest.approx(1.0, abs=1e-4)
        # five standard deviations of as many samples
        expected = into * out
        assert abs(upwards.mean() * len(places) / n - expected) < 5.0 * np.sqrt(expected / n)
