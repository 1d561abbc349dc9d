"""The BSDF `diffraction_orders` of every kind of table: values, samples and densities."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.optics.colour import linear_srgb, response
from tests.orders.kinds import (
    KINDS,
    NM,
    TURN,
    albedo_of,
    indices,
    light_of,
    loaded,
    near_orders,
)
from tests.support.chi_square import DISPERSED, Case, chi_square
from tests.support.directions import polar, turned, uniform_directions
from tests.support.lanes import evaluated, interaction, vectors
from tests.support.variants import evaluate

#: Of kinds that interpolate more than half floats: sums of reflections with a kink at each critical
#: angle; and rows that also sum orders just beyond their Rayleigh anomalies, which are not drawn.
TOLERANCE = {"coated": 0.01, "crossed": 3e-3, "crossed, clear": 3e-3}


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in TOLERANCE])
def test_values_are_the_table_s_and_weights_the_albedo(some_variant, kind):
    table = KINDS[kind]()
    wi, wo, samples, lam = near_orders(table, 100)
    lam[:] = lam[:, :1]
    values, _, _, _, drawn, _, weights = evaluate(loaded(kind), wi, wo, samples, lam)
    expected = light_of(table, wi, wo, lam[:, 0])
    assert np.abs(values[:, 0] - expected).sum() <= 3e-3 * expected.sum()
    valid = weights[:, 0] > 0.0
    assert valid.mean() > 0.85
    far = valid & (np.minimum(np.abs(wi[:, 2]), np.abs(drawn[:, 2])) > 0.25)  # where C is 1
    assert far.mean() > 0.6
    # drawn exactly: half floats are rounded up; radiance is over n²
    ratio = (indices(table, wi) / indices(table, drawn))[far, 0] ** 2
    assert weights[far, 0] == pytest.approx(ratio * albedo_of(table, wi, lam[:, 0])[far], rel=5e-3)
    context = mi.BSDFContext(mi.TransportMode.Importance)
    importance = np.array(loaded(kind).eval(context, interaction(wi, lam), vectors(wo))).T
    scale = (indices(table, wi) / indices(table, wo)) ** 2
    assert importance * scale == pytest.approx(values, rel=1e-5)


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=() if k == "crossed" else pytest.mark.thorough) for k in KINDS]
)
def test_every_variant_has_the_same_light(every_variant, kind):
    if mi.is_rgb and kind == "polarised":
        pytest.skip("its wavelengths end amid lobes of daylight")
    table, n = KINDS[kind](), 6 if "scalar" in every_variant or mi.is_rgb else 24
    wi, wo, samples, lam = near_orders(table, n)
    lam = lam if mi.is_spectral else np.full((n, 4), NM)
    bsdf = loaded(kind)
    values, pdf, again, pdf_again, drawn, density, weight = evaluate(bsdf, wi, wo, samples, lam)
    assert again == pytest.approx(values, rel=1e-4, abs=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-4, abs=1e-5)
    nm = np.tile(np.arange(380.5, 780.0), (n, 1)) if mi.is_rgb else lam[:, : values.shape[1]]
    lanes = (np.repeat(w, nm.shape[1], axis=0) for w in (wi, wo))
    expected = light_of(table, *lanes, nm.ravel()).reshape(nm.shape)
    if mi.is_rgb:
        expected = expected @ linear_srgb(response(nm[0]))
    # half floats, and lobes of 1e-3 in single precision; in RGB variants the efficiency is that at
    # the middle of each lobe, within which it changes (of constant ones the sum is right to 6e-4)
    tolerance = max(TOLERANCE.get(kind, 0.0), 0.02 if mi.is_rgb else 3e-3)
    assert np.abs(values - expected).sum() <= tolerance * np.abs(expected).sum()
    lit = density > 0.0
    assert lit.any()
    there, dense, *_ = evaluate(bsdf, wi, np.where(lit[:, None], drawn, wo), samples, lam)
    assert dense[lit] == pytest.approx(density[lit], rel=1e-3)
    assert (weight * density[:, None])[lit] == pytest.approx(
        there[lit], rel=2e-3, abs=1e-5 * np.abs(there).max()
    )


@pytest.mark.parametrize(("kind", "width"), [("grooves", 3.2), ("crossed", 2.2)])
def test_lobes_of_two_periods_overlap_and_add_up(some_variant, kind, width):
    wi, wo = (uniform_directions(200, np.random.default_rng(seed), 0.3) for seed in (3, 4))
    found = evaluated(loaded(kind, coherence_width=width), wi, wo, np.full((200, 4), NM))
    expected = light_of(KINDS[kind](), wi, wo, np.full(200, NM), width)
    assert np.abs(found[:, 0] - expected).sum() <= 3e-3 * expected.sum()  # half floats


def test_in_grazing_light_order_0_alone_is_corrected():
    mi.set_variant("scalar_spectral_polarized")
    table, out = KINDS["crossed"](), polar(82.0, 47.0)
    shift = 0.55 * np.array([[0.0, 1.0], [1.0, 0.0]]) / table.periods
    wi = np.column_stack([shift - out[:2], [0.0, 0.0]])
    wi[:, 2] = np.sqrt(1.0 - (wi**2).sum(axis=1))
    wi, wo = (turned(w, TURN) for w in (wi, np.tile(out, (2, 1))))
    values, *_ = evaluate(loaded("crossed"), wi, wo, np.full((2, 3), 0.5), np.full((2, 4), 550.0))
    expected = light_of(table, wi, wo, np.full(2, 550.0))
    assert values[:, 0] == pytest.approx(expected, rel=3e-3)  # half floats


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "theta", "side"),
    [
        ("grooves", 0.0, 1.0),
        ("grooves", 60.0, 1.0),
        ("listed", 35.0, 1.0),
        ("crossed", 30.0, 1.0),
        ("crossed, clear", 30.0, 1.0),
        ("sheet", 30.0, 1.0),
        ("sheet", 30.0, -1.0),
        *(("block", theta, side) for theta in (30.0, 150.0, 110.0) for side in (1.0, -1.0)),
    ],
)
def test_the_density_is_that_of_the_samples(some_variant, kind, theta, side):
    # a window of three periods: lobes that overlap, and wide enough for the histogram
    width = 3.0 * min(KINDS[kind]().periods)
    bsdf = loaded(kind, coherence_width=width, orientation=0.0)
    test = chi_square(bsdf, Case(None, theta, DISPERSED, side=side), samples=1 << 19)
    # 1 % for the cases of a table together; the numbers drawn are always the same
    assert test.run(0.01, 6 if kind == "block" else 2, quiet=True), test.messages


@pytest.mark.parametrize("component", [0, 1])
@pytest.mark.parametrize("kind", ["sheet", "block"])
def test_a_component_is_the_light_of_its_side(some_variant, kind, component):
    wi, wo, samples, lam = near_orders(KINDS[kind](), 40)
    bsdf = loaded(kind)
    assert mi.has_flag(bsdf.flags(), mi.BSDFFlags.GlossyTransmission)
    whole = evaluate(bsdf, wi, wo, samples, lam)[0]
    part = evaluate(bsdf, wi, wo, samples, lam, component)
    passed = wi[:, 2] * wo[:, 2] < 0.0
    assert np.array_equal(part[0], np.where((passed == component)[:, None], whole, 0.0))
    sides = part[4][:, 2] * wi[:, 2] < 0.0
    assert np.all(part[5][sides != component] == 0.0)
    numbers = mi.Float(samples[:, 0]), mi.Point2f(samples[:, 1:].T)
    drawn, _ = bsdf.sample(mi.BSDFContext(), interaction(wi, lam), *numbers)
    lit, left = np.array(drawn.pdf) > 0.0, np.array(drawn.wo).T
    entered = (indices(KINDS[kind](), left) / indices(KINDS[kind](), wi))[lit, 0]
    assert np.array(drawn.eta)[lit] == pytest.approx(entered, rel=1e-6)


@pytest.mark.parametrize(
    ("variant", "kind"),
    [
        ("llvm_ad_spectral", "crossed"), ("llvm_ad_rgb", "crossed"),
        pytest.param("llvm_ad_spectral", "block", marks=pytest.mark.thorough),
    ],
)  # fmt: skip
def test_the_orientation_has_a_derivative(variant, kind):
    """Grooves and sheets are rendered by tests/plugin/test_rendered_derivatives_thorough.py."""
    mi.set_variant(variant)
    wi, wo, _, lam = near_orders(KINDS[kind](), 60)
    bsdf, si = loaded(kind), interaction(wi, lam[:, :1])
    parameters = mi.traverse(bsdf)

    def light(degrees, differentiable=False):
        parameters["orientation"] = mi.Float(degrees)
        if differentiable:
            dr.enable_grad(parameters["orientation"])
        parameters.update()
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, vectors(wo)), axis=None)

    dr.backward(light(25.0, differentiable=True))
    slope = float(np.ravel(dr.grad(parameters["orientation"]))[0])
    low, high = (float(np.ravel(light(25.0 + step))[0]) for step in (-0.05, 0.05))
    # single precision, and half floats of a table that is linear between its nodes
    assert slope == pytest.approx((high - low) / 0.1, rel=0.03)
