"""`diffraction_mix` over depth: light between solved depths, textures, derivatives, refusals."""

from __future__ import annotations

import dataclasses

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.lanes import interaction
from tests.support.variants import evaluate

#: Reflectances of mirrors that stand for three depths, µm, not in their order.
DEPTHS = {"middle": (0.2, 0.8), "shallow": (0.1, 0.2), "deep": (0.4, 0.5)}
WIDTH = 8.0


def grating(depth, reflectance, period=0.9, **more):
    table = md.OrderTable.mirror(period, reflectance)
    table = dataclasses.replace(table, header=table.header | {"depth": depth})
    return md.bsdf_dict(table, coherence_width=WIDTH, **more)


def surfaces():
    return {name: grating(*numbers) for name, numbers in DEPTHS.items()}


def load(depth):
    return mi.load_dict({"type": "diffraction_mix", "depth": depth, **surfaces()})


def expected(depth):
    """Reflectance of a depth, linear between the three."""
    return np.interp(depth, (0.1, 0.2, 0.4), (0.2, 0.8, 0.5))


@pytest.mark.parametrize("depth", [0.15, 0.4])
def test_light_is_interpolated_between_the_nearest_depths(every_variant, depth):
    wi = np.array([[0.3, 0.1, np.sqrt(0.9)]] * 4)
    wo, samples = wi * [-1.0, -1.0, 1.0], np.random.default_rng(0).random((4, 3))
    waves = np.full((4, 4), 550.0)
    values, *_, weight = evaluate(load(depth), wi, wo, samples, waves)
    whole, *_ = evaluate(mi.load_dict(grating(0.1, 1.0)), wi, wo, samples, waves)
    assert values == pytest.approx(expected(depth) * whole, rel=2e-3)  # half floats
    assert weight[0] == pytest.approx(expected(depth), rel=5e-3 if not mi.is_rgb else 0.9)


def test_a_texture_varies_the_depth(variant):
    depths = np.array([[0.12, 0.31], [0.2, 0.4]], np.float32)
    texture = {"type": "bitmap", "raw": True, "filter_type": "nearest",
               "data": mi.TensorXf(depths[..., None])}  # fmt: skip
    uv = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]])
    wi = np.array([[0.0, 0.2, np.sqrt(0.96)]] * 4)
    si = interaction(wi, np.full((4, 4), 550.0))
    si.uv = mi.Point2f(uv.T)
    wo = mi.Vector3f((wi * [-1.0, -1.0, 1.0]).T)
    found = np.array(load(texture).eval(mi.BSDFContext(), si, wo))[0]
    whole = np.array(mi.load_dict(grating(0.1, 1.0)).eval(mi.BSDFContext(), si, wo))[0]
    assert found / whole == pytest.approx(expected(depths.ravel()), rel=2e-3)


def test_values_have_the_derivative_of_the_interpolation(variant):
    wi = np.array([[0.0, 0.2, np.sqrt(0.96)]] * 4)
    si = interaction(wi, np.full((4, 4), 550.0))
    bsdf = load(0.16)
    parameters = mi.traverse(bsdf)
    dr.enable_grad(parameters["depth"])
    parameters.update()
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f((wi * [-1.0, -1.0, 1.0]).T))
    dr.forward(parameters["depth"])
    # light is in proportion to the reflectance, 0.56; its slope is 6 a micrometre
    slope = np.array(dr.grad(value)) / np.array(value)
    assert slope == pytest.approx(6.0 / 0.56, rel=2e-3)  # half floats


def test_the_depth_changes(variant):
    bsdf = load(0.15)
    parameters = mi.traverse(bsdf)
    parameters["depth"] = 0.3
    parameters.update()
    assert "0.3 µm" in str(bsdf)
    parameters["depth"] = 0.5
    with pytest.raises(Exception, match=r"at most 0\.4 µm"):
        parameters.update()


def test_weights_are_shares_of_their_sum_and_components_follow_each_other():
    mi.set_variant("scalar_spectral_polarized")
    white = {
        "type": "bitmap",
        "raw": True,
        "data": mi.TensorXf(np.full((2, 2, 1), 0.2, np.float32)),
    }
    mix = mi.load_dict(
        {"type": "diffraction_mix", "first": {"type": "plastic"}, "weight_first": white,
         "second": {"type": "diffuse"}, "weight_second": 0.3}
    )  # fmt: skip
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.0, 0.6, 0.8)
    assert mix.weights.at(si, True) == pytest.approx([0.4, 0.6])
    for component in range(mix.component_count()):  # the first has two
        context = mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, component)
        assert mix.sample(context, si, 0.5, [0.3, 0.4])[0].sampled_component == component


def named(**change):
    """The dictionary of a mix over depth, with some parts replaced."""
    return {"type": "diffraction_mix", "depth": 0.2, **surfaces()} | change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"depth": 0.5}, r"depth=0\.5 µm must be at least 0\.1 µm and at most 0\.4 µm"),
        ({"depth": "deep"}, "must be"),
        ({"weight_deep": 0.5}, "takes no weights beside depth"),
        ({"deep": grating(0.2, 0.5)}, r"both 0\.2 µm deep"),
        (
            {"deep": md.bsdf_dict(md.OrderTable.mirror(0.9), coherence_width=WIDTH)},
            "solve it again",
        ),
        ({"deep": grating(0.4, 0.5, period=0.8)}, "periods of middle and deep differ"),
        ({"deep": {"type": "diffuse"}}, "deep has no solved orders"),
    ],
)
def test_what_cannot_be_interpolated_is_refused(variant, change, message):
    with pytest.raises(Exception, match=message):
        mi.load_dict(named(**change))
