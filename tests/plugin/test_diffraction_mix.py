"""`diffraction_mix`: surfaces by weights or over depth, textures, derivatives, and refusals."""

from __future__ import annotations

import dataclasses

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import rough_patch
from tests.support.gentle import PATCH, UV, WIDTH, hits, pairs
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


@pytest.mark.thorough
def test_it_is_the_mean_of_its_surfaces_by_weight(variant):
    wi, wo, lam = pairs(100)
    alone = [mi.load_dict(one) for one in surfaces().values()]
    both = mix(weight_back=bitmap(WEIGHTS))
    context, uv = mi.BSDFContext(), np.resize(UV, (100, 2))
    si, out, w = hits(wi, uv, lam[:, None]), vectors(wo), np.resize(WEIGHTS.ravel(), 100)
    values, densities = zip(*(one.eval_pdf(context, si, out) for one in alone), strict=True)
    found = (
        *both.eval_pdf(context, si, out),
        both.eval(context, si, out),
        both.pdf(context, si, out),
    )
    dr.eval(values, densities, found)  # one kernel instead of eight
    value = w[:, None] * spectra(values[0]) + (1 - w[:, None]) * spectra(values[1])
    density = w * np.array(densities[0]) + (1 - w) * np.array(densities[1])
    for one, expected in (
        (spectra(found[0]), value), (spectra(found[2]), value),
        (np.array(found[1]), density), (np.array(found[3]), density),
    ):  # fmt: skip
        assert one == pytest.approx(expected, rel=1e-5, abs=1e-6 * float(expected.max()))


@pytest.mark.thorough
@pytest.mark.parametrize("component", [0xFFFFFFFF, 0, 1, 2])
def test_samples_add_up_to_the_value(variant, component):
    """∫ f cosθ dω by samples, mirrors included, against that of each surface by weight."""
    wi, _, lam = pairs(1)
    n = 40_000
    rng = np.random.default_rng(1)
    si = hits(np.repeat(wi, n, axis=0), UV[2], np.repeat(lam, n)[:, None])
    numbers = mi.Float(rng.random(n)), mi.Point2f(*rng.random((2, n)).astype(np.float32))

    def albedo(bsdf, component=component):
        context = mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, component)
        drawn, weight = bsdf.sample(context, si, *numbers)
        if component < bsdf.component_count():
            assert (np.array(drawn.sampled_component) == component).all()
        return spectra(weight)[:, 0]

    both, (back, belly) = mix(weight_back=bitmap(WEIGHTS)), map(mi.load_dict, surfaces().values())
    found = albedo(both)
    parts = {0: [(0.25, back, 0)], 1: [(0.75, belly, 0)], 2: [(0.75, belly, 1)]}
    whole = [(0.25, back, 0xFFFFFFFF), (0.75, belly, 0xFFFFFFFF)]
    expected = sum(w * albedo(one, c).mean() for w, one, c in parts.get(component, whole))
    # standard errors of both; a surface that is drawn without noise has rounding alone
    noise = max(5.0 * found.std() / np.sqrt(n), 4e-7)
    assert found.mean() == pytest.approx(expected, abs=noise)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({}, "there is no weight_back, weight_belly"),
        ({"weight_back": -0.5}, "weight_back=-0.5 must be at least 0"),
        ({"weight_back": "much"}, "weight_back='much' must be"),
        ({"weight_back": lambda: bitmap(-WEIGHTS)}, "numbers go from -1"),
        ({"weight_back": lambda: bitmap(WEIGHTS * np.nan)}, "numbers go from nan"),
        ({"weight_back": lambda: bitmap(WEIGHTS, raw=False)}, "takes numbers for colours"),
        (
            {"weight_back": 0.0, "weight_belly": 0.0},
            "weight_back, weight_belly are all 0 somewhere",
        ),
        ({"weight_back": lambda: bitmap(WEIGHTS), "weight_belly": 0.0}, "are all 0 somewhere"),
        ({"weight_side": 1.0, "weight_back": 1.0}, "unknown parameter 'weight_side'"),
        ({"weight_back": 1.0, "height_scale": 1.0}, "its surfaces are back, belly"),
        ({"belly": None, "weight_back": 1.0}, "takes two nested BSDFs or more, got 1"),
    ],
)
def test_weights_that_mean_nothing_are_refused(some_variant, parameters, said):
    made = {k: v() if callable(v) else v for k, v in (surfaces() | parameters).items()}
    given = {k: v for k, v in made.items() if v is not None}
    assert said in refusal(lambda: mi.load_dict({"type": "diffraction_mix", **given}))


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


@pytest.mark.parametrize("depth", [0.15, 0.4])
def test_light_is_interpolated_between_the_nearest_depths(every_variant, depth):
    wi = np.array([[0.3, 0.1, np.sqrt(0.9)]] * 4)
    wo, samples = wi * [-1.0, -1.0, 1.0], np.random.default_rng(0).random((4, 3))
    waves = np.full((4, 4), 550.0)
    values, *_, weight = evaluate(at_depth(depth), wi, wo, samples, waves)
    whole, *_ = evaluate(mi.load_dict(grating(0.1, 1.0)), wi, wo, samples, waves)
    assert values == pytest.approx(reflectance_at(depth) * whole, rel=2e-3)  # half floats
    assert weight[0] == pytest.approx(reflectance_at(depth), rel=5e-3 if not mi.is_rgb else 0.9)


def test_a_texture_varies_the_depth(variant):
    depths = np.array([[0.12, 0.31], [0.2, 0.4]], np.float32)
    wi = np.array([[0.0, 0.2, np.sqrt(0.96)]] * 4)
    si = hits(wi, UV)
    wo = mi.Vector3f((wi * [-1.0, -1.0, 1.0]).T)
    found = np.array(at_depth(bitmap(depths)).eval(mi.BSDFContext(), si, wo))[0]
    whole = np.array(mi.load_dict(grating(0.1, 1.0)).eval(mi.BSDFContext(), si, wo))[0]
    assert found / whole == pytest.approx(reflectance_at(depths.ravel()), rel=2e-3)


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


def named(**change):
    """The dictionary of a mix over depth, with some parts replaced."""
    return {"type": "diffraction_mix", "depth": 0.2, **of_depths()} | change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"depth": 0.5}, r"depth=0\.5 µm must be at least 0\.1 µm and at most 0\.4 µm"),
        ({"depth": "deep"}, "must be"),
        ({"weight_deep": 0.5}, "takes no weights beside depth"),
        ({"deep": grating(0.2, 0.5)}, r"both 0\.2 µm deep"),
        (
            {"deep": md.bsdf_dict(md.OrderTable.mirror(0.9), coherence_width=8.0)},
            "solve it again",
        ),
        ({"deep": grating(0.4, 0.5, period=0.8)}, "periods of middle and deep differ"),
        ({"deep": {"type": "diffuse"}}, "deep has no solved orders"),
    ],
)
def test_what_cannot_be_interpolated_is_refused(variant, change, message):
    with pytest.raises(Exception, match=message):
        mi.load_dict(named(**change))
