"""The BSDF of a block's face in all variants, its samples on both sides, and derivatives."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.orders.blocks import BLOCK, WIDTH, indices, near_orders, reference
from tests.support.chi_square import DISPERSED, Case, chi_square
from tests.support.orders import load
from tests.support.transmitting import OneSide
from tests.support.variants import evaluate, interaction

pytestmark = pytest.mark.thorough


def test_every_variant_has_the_same_light(every_variant):
    n = 4 if "scalar" in every_variant else 24
    wi, wo, orders = near_orders(n)
    samples = np.random.default_rng(0).random((n, 3))
    values, pdf, _, _, drawn, drawn_pdf, weight = evaluate(
        load(BLOCK, coherence_width=WIDTH, wavelength=550.0),
        wi,
        wo,
        samples,
        np.full((n, 4), 550.0),
    )
    assert np.isfinite(weight).all()
    assert (drawn_pdf > 0.0).mean() > 0.9
    if mi.is_rgb:
        # daylight's lobes are wider
        assert values[pdf > 0.0].sum() > 0.0
        return
    ratio = (indices(wi) / indices(wo))[:, 0] ** 2
    expected = reference(wi, wo, orders)
    # half floats, and lobes of 1e-3 in single precision
    assert np.abs(values[:, 0] - ratio * expected).sum() < 3e-3 * expected.sum()
    assert np.abs(pdf - expected).sum() < 3e-3 * expected.sum()
    cross = drawn[:, 2] * wi[:, 2] < 0.0
    lit = drawn_pdf > 0.0
    scale = np.where(cross, (indices(wi) / indices(drawn))[:, 0] ** 2, 1.0)
    assert weight[lit, 0] == pytest.approx(scale[lit], rel=5e-3)


@pytest.mark.parametrize("theta", [30.0, 150.0, 110.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_density_is_that_of_the_samples_on_either_side(some_variant, theta, side):
    # a window of three periods: lobes that overlap, and wide enough for the histogram
    bsdf = OneSide(load(BLOCK, coherence_width=3.0 * BLOCK.period), side)
    test = chi_square(bsdf, Case(None, theta, DISPERSED), samples=1 << 19)
    # 1 % for six of them; the numbers drawn are always the same
    assert test.run(0.01, 6, quiet=True), test.messages


def test_light_of_rgb_variants_is_daylight_s_share(some_variant):
    mi.set_variant("llvm_ad_rgb")
    n = 1 << 14
    rng = np.random.default_rng(0)
    bsdf = load(BLOCK)
    for z in (0.8, -0.8):
        si = interaction(np.tile([0.6, 0.0, z], (n, 1)), np.full((n, 4), 550.0))
        context = mi.BSDFContext(mi.TransportMode.Importance)
        numbers = mi.Float(rng.random(n)), mi.Point2f(rng.random((2, n)))
        _, weight = bsdf.sample(context, si, *numbers)
        # all light but for daylight below 420 and above 697 nm, which the table has not
        assert np.array(weight).mean() == pytest.approx(1.0, abs=0.05)


def test_derivatives_follow_the_orientation(some_variant):
    wi, wo, _ = near_orders(32)
    bsdf = load(BLOCK, orientation=1.0, coherence_width=20.0)
    parameters = mi.traverse(bsdf)
    si = interaction(wi, np.full((len(wi), 4), 550.0))

    def light():
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))[0])

    dr.enable_grad(parameters["orientation"])
    parameters.update()
    dr.backward(light())
    derivative = float(parameters["orientation"].grad[0])
    step, ends = 0.02, []
    for degrees in (1.0 - step, 1.0 + step):
        parameters["orientation"] = mi.Float(degrees)
        parameters.update()
        ends.append(float(light()[0]))
    # central differences in single precision
    assert derivative == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=2e-2)
