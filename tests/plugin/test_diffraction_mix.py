"""`diffraction_mix`: surfaces by weights or over depth, textures, derivatives, and refusals."""

from __future__ import annotations

import dataclasses

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import rough_patch
from tests.support.gentle import PATCH, UV, WIDTH, hits
from tests.support.lanes import bitmap, interaction, refusal, spectra, vectors
from tests.support.variants import evaluate

OTHER = rough_patch((60, 60), (0.08, 0.08), 0.1, seed=3)
RAW = {"material": "none", "energy_conserving": False, "coherence_width": WIDTH}
PIGMENTED = {"int_ior": 1.5, "pigment": {"type": "conductor"}, "energy_conserving": False}
WEIGHTS = np.array([[1.0, 0.0], [0.25, 0.6]], np.float32)


def surfaces():
    """Two, with other orders, one over a mirror."""
    pigmented = PIGMENTED | {"coherence_width": WIDTH}
    return {"back": md.bsdf_dict(PATCH, **RAW), "belly": md.bsdf_dict(OTHER, **pigmented)}


def mix(**weights):
    return mi.load_dict({"type": "diffraction_mix", **surfaces(), **weights})


#: Reflectances of mirrors that stand for three depths, µm, not in their order.
DEPTHS = {"middle": (0.2, 0.8), "shallow": (0.1, 0.2), "deep": (0.4, 0.5)}


def grating(depth, reflectance, period=0.9, **more):
    table = md.OrderTable.mirror(period, reflectance)
    table = dataclasses.replace(table, header=table.header | {"depth": depth})
    return md.bsdf_dict(table, coherence_width=8.0, **more)


def of_depths():
    return {name: grating(*numbers) for name, numbers in DEPTHS.items()}


def at_depth(depth):
    return mi.load_dict({"type": "diffraction_mix", "depth": depth, **of_depths()})


def reflectance_at(depth):
    """Reflectance of a depth, linear between the three."""
    return np.interp(depth, (0.1, 0.2, 0.4), (0.2, 0.8, 0.5))


def test_light_is_interpolated_between_the_nearest_depths_of_a_texture(every_variant):
    depths = np.array([[0.12, 0.31], [0.2, 0.4]], np.float32)
    wi = np.array([[0.0, 0.2, np.sqrt(0.96)]] * 4)
    wo, samples = wi * [-1.0, -1.0, 1.0], np.random.default_rng(0).random((4, 3))
    waves, reflectances = np.full((4, 4), 550.0), reflectance_at(depths.ravel())
    whole, *_ = evaluate(mi.load_dict(grating(0.1, 1.0)), wi, wo, samples, waves)
    values, *_, weight = evaluate(at_depth(0.31), wi, wo, samples, waves)
    assert values == pytest.approx(reflectances[1] * whole, rel=2e-3)  # half floats
    assert weight[0] == pytest.approx(reflectances[1], rel=5e-3 if not mi.is_rgb else 0.9)
    if dr.is_jit_v(mi.Float):
        si = hits(wi, UV)
        found = at_depth(bitmap(depths)).eval(mi.BSDFContext(), si, vectors(wo))
        found = spectra(mi.unpolarized_spectrum(found))[:, 0]
        assert found == pytest.approx(reflectances * whole[:, 0], rel=2e-3)


def test_values_have_the_derivative_of_the_interpolation(variant):
    wi = np.array([[0.0, 0.2, np.sqrt(0.96)]] * 4)
    si = interaction(wi, np.full((4, 4), 550.0))
    bsdf = at_depth(0.16)
    parameters = mi.traverse(bsdf)
    dr.enable_grad(parameters["depth"])
    parameters.update()
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f((wi * [-1.0, -1.0, 1.0]).T))
    dr.forward(parameters["depth"])
    # light is in proportion to the reflectance, 0.56; its slope is 6 a micrometre
    slope = np.array(dr.grad(value)) / np.array(value)
    assert slope == pytest.approx(6.0 / 0.56, rel=2e-3)  # half floats


def test_the_depth_changes(variant):
    bsdf = at_depth(0.15)
    parameters = mi.traverse(bsdf)
    parameters["depth"] = 0.3
    parameters.update()
    assert "0.3 µm" in str(bsdf)
    parameters["depth"] = 0.5
    with pytest.raises(Exception, match=r"at most 0\.4 µm"):
        parameters.update()


def test_weights_are_shares_of_their_sum_and_components_follow_each_other():
    mi.set_variant("scalar_spectral_polarized")
    first = {"first": {"type": "plastic"}, "weight_first": bitmap(np.full((2, 2), 0.2))}
    second = {"second": {"type": "diffuse"}, "weight_second": 0.3}
    mix = mi.load_dict({"type": "diffraction_mix", **first, **second})
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0.0, 0.6, 0.8)
    assert mix.weights.at(si, True) == pytest.approx([0.4, 0.6])
    for component in range(mix.component_count()):  # the first has two
        context = mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, component)
        assert mix.sample(context, si, 0.5, [0.3, 0.4])[0].sampled_component == component


SURFACES, OF_DEPTHS = surfaces(), {"depth": 0.2, **of_depths()}
UNKNOWN_DEPTH = md.bsdf_dict(md.OrderTable.mirror(0.9), coherence_width=8.0)


@pytest.mark.parametrize(
    ("parts", "change", "said"),
    [
        (SURFACES, {}, "there is no weight_back, weight_belly"),
        (SURFACES, {"weight_back": -0.5}, "weight_back=-0.5 must be at least 0"),
        (SURFACES, {"weight_back": "much"}, "weight_back='much' must be"),
        (SURFACES, {"weight_back": lambda: bitmap(-WEIGHTS)}, "numbers go from -1"),
        (SURFACES, {"weight_back": lambda: bitmap(WEIGHTS * np.nan)}, "numbers go from nan"),
        (SURFACES, {"weight_back": lambda: bitmap(WEIGHTS, raw=False)}, "numbers for colours"),
        (SURFACES, {"weight_back": 0.0, "weight_belly": 0.0}, "weight_belly are all 0 somewhere"),
        (
            SURFACES,
            {"weight_back": lambda: bitmap(WEIGHTS), "weight_belly": 0.0},
            "all 0 somewhere",
        ),
        (SURFACES, {"weight_side": 1.0, "weight_back": 1.0}, "unknown parameter 'weight_side'"),
        (SURFACES, {"weight_back": 1.0, "height_scale": 1.0}, "its surfaces are back, belly"),
        (SURFACES, {"belly": None, "weight_back": 1.0}, "two nested BSDFs or more, got 1"),
        (OF_DEPTHS, {"depth": 0.5}, "depth=0.5 µm must be at least 0.1 µm and at most 0.4 µm"),
        (OF_DEPTHS, {"depth": "deep"}, "must be"),
        (OF_DEPTHS, {"weight_deep": 0.5}, "takes no weights beside depth"),
        (OF_DEPTHS, {"deep": grating(0.2, 0.5)}, "both 0.2 µm deep"),
        (OF_DEPTHS, {"deep": UNKNOWN_DEPTH}, "solve it again"),
        (OF_DEPTHS, {"deep": grating(0.4, 0.5, period=0.8)}, "periods of middle and deep differ"),
        (OF_DEPTHS, {"deep": {"type": "diffuse"}}, "deep has no solved orders"),
    ],
)
def test_mixes_that_mean_nothing_are_refused(some_variant, parts, change, said):
    given = {k: v() if callable(v) else v for k, v in (parts | change).items() if v is not None}
    assert said in refusal(lambda: mi.load_dict({"type": "diffraction_mix", **given}))
