"""The BSDF of a crossed grating: values of the table, samples, power, what refuses it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import sigma_of
from tests.support import crossed
from tests.support.variants import evaluate, interaction

WIDTH, TURN, LAM = 8.0, 25.0, 550.0


@pytest.fixture(scope="module")
def table():
    return crossed.table()


def load(table, **more):
    options = {"coherence_width": WIDTH, "orientation": TURN, "wavelength": LAM} | more
    return mi.load_dict(md.bsdf_dict(table, **options))


def turned(directions, degrees):
    """Tangential parts in axes turned by an angle."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.stack([c * directions[:, 0] + s * directions[:, 1],
                     c * directions[:, 1] - s * directions[:, 0]], axis=1)  # fmt: skip


def near_orders(count, seed=0):
    """Pairs of directions near orders, and these orders."""
    rng = np.random.default_rng(seed)
    radius, turn = 0.5 * np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
    wi = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    orders = rng.integers(-1, 2, (count, 2))
    grid = orders * LAM / (1e3 * np.array(crossed.PERIODS))
    wo = turned(grid + rng.normal(0.0, 0.006, (count, 2)), -TURN) - wi
    keep = (wo**2).sum(axis=1) < 0.9
    wi, wo, orders = wi[keep], wo[keep], orders[keep]
    return *(np.column_stack([w, np.sqrt(1.0 - (w**2).sum(axis=1))]) for w in (wi, wo)), orders


def expected(table, wi, wo, orders):
    """f cosθo by its formula (module `lobes`), of the nearest order alone."""
    sigma, k = sigma_of(WIDTH), 2e3 * np.pi / LAM
    uv, mirror = turned(wi + wo, TURN), -turned(wi, TURN)
    q = k * uv - 2.0 * np.pi * orders / np.array(crossed.PERIODS)
    power = table.efficiency(mirror[:, 0], mirror[:, 1], LAM, *orders.T)
    lobe = (k * sigma) ** 2 / np.pi * np.exp(-(sigma**2) * (q**2).sum(axis=1))
    return power * lobe * wo[:, 2]


def test_every_variant_has_the_table_s_light(every_variant, table):
    wi, wo, orders = near_orders(6 if "scalar" in every_variant else 200)
    rng = np.random.default_rng(1)
    waves = np.full((len(wi), 4), LAM)
    values, pdf, again, pdf_again, _, drawn_pdf, weight = evaluate(
        load(table), wi, wo, rng.random((len(wi), 3)), waves
    )
    assert again == pytest.approx(values, rel=1e-4, abs=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-4, abs=1e-5)
    assert (drawn_pdf > 0.0).mean() > 0.8
    assert np.isfinite(weight).all()
    # RGB draws wavelengths for all channels together, blue with a fifth of the probability
    assert weight.max() <= (5.0 if mi.is_rgb else 1.02)
    if mi.is_rgb:  # daylight's lobes are wider
        assert values.sum() > 0.0
        return
    truth = expected(table, wi, wo, orders)
    # half floats, and lobes of 1e-3 in single precision
    assert np.abs(values[:, 0] - truth).sum() < 3e-3 * truth.sum()


@pytest.mark.parametrize("make", [crossed.table, crossed.clear_table])
def test_samples_carry_the_power_of_all_orders(variant, make):
    n, table = 1 << 17, make()
    rng = mi.PCG32(n)
    wi = np.array([0.3, -0.2, np.sqrt(0.87)])
    si = interaction(np.repeat(wi[None], n, 0), np.full((n, 4), LAM))
    two = mi.Point2f(rng.next_float32(), rng.next_float32())
    bsdf = load(table)
    sample, weight = bsdf.sample(mi.BSDFContext(), si, rng.next_float32(), two)
    again = bsdf.pdf(mi.BSDFContext(), si, sample.wo)
    assert dr.allclose(dr.select(sample.pdf > 0.0, again - sample.pdf, 0.0), 0.0)
    x, y = -turned(wi[None], TURN)[0]
    m, k = np.mgrid[-4:5, -5:6]
    # lobes at the horizon are cut
    power = table.efficiency(x, y, LAM, m, k).sum()
    assert np.array(weight)[0].mean() == pytest.approx(power, rel=5e-3)


def test_samples_and_values_agree_over_the_hemisphere(variant, table):
    n = 1 << 20
    rng = mi.PCG32(n)
    wi = np.array([0.1, 0.25, np.sqrt(1.0 - 0.0725)])
    si = interaction(np.repeat(wi[None], n, 0), np.full((n, 4), LAM))
    square = mi.Point2f(rng.next_float32(), rng.next_float32())
    wo = mi.warp.square_to_uniform_hemisphere(square)
    # a window of two periods, whose lobes overlap
    value, pdf = load(table, coherence_width=2.2).eval_pdf(mi.BSDFContext(), si, wo)
    two = mi.Point2f(rng.next_float32(), rng.next_float32())
    _, weight = load(table, coherence_width=2.2).sample(
        mi.BSDFContext(), si, rng.next_float32(), two
    )
    uniform = 2.0 * np.pi * np.array(value)[0].mean()
    assert uniform == pytest.approx(np.array(weight)[0].mean(), rel=0.01)  # 4σ of the noise
    assert 2.0 * np.pi * np.array(pdf).mean() <= 1.01


def test_rgb_has_the_colours_of_the_spectrum():
    table = crossed.clear_table()  # its oblique orders are half as bright as its others
    wi, wo, orders = near_orders(60, seed=3)
    mi.set_variant("llvm_ad_rgb")
    rgb = np.array(
        load(table).eval(
            mi.BSDFContext(), interaction(wi, np.zeros((len(wi), 4))), mi.Vector3f(wo.T)
        )
    )
    mi.set_variant("llvm_ad_spectral")
    from mitsuba_diffraction.optics.colour import linear_srgb, response

    lam = np.arange(380.25, 780.0, 0.5)
    colours = linear_srgb(response(lam))
    colours /= colours.sum(axis=0)
    total = np.zeros((3, len(wi)))
    bsdf = load(table)
    for start in range(0, len(lam), 4):
        waves = np.repeat(lam[None, start : start + 4], len(wi), 0)
        values = np.array(bsdf.eval(mi.BSDFContext(), interaction(wi, waves), mi.Vector3f(wo.T)))
        total += colours[start : start + 4].T @ values
    oblique = orders.all(axis=1)
    for kind in (oblique, ~oblique):
        # the same wavelengths' efficiencies; those beyond the table's are dark in both
        assert np.abs(rgb - total)[:, kind].sum() < 0.03 * np.abs(total[:, kind]).sum()


def test_in_grazing_light_order_0_alone_is_corrected(table):
    mi.set_variant("scalar_spectral_polarized")
    wo = np.array([0.3, np.sqrt(0.89), np.sqrt(0.02)])
    orders = np.array([[0, 1], [1, 0]])
    shifts = orders * LAM / (1e3 * np.array(crossed.PERIODS))
    wi = np.column_stack([turned(shifts, -TURN) - wo[:2], [0.0, 0.0]])
    wi[:, 2] = np.sqrt(1.0 - (wi**2).sum(axis=1))
    wo, waves = np.tile(wo, (2, 1)), np.full((2, 4), LAM)
    values = evaluate(load(table), wi, wo, np.full((2, 3), 0.5), waves)[0][:, 0]
    assert values == pytest.approx(expected(table, wi, wo, orders), rel=3e-3)  # half floats


def test_a_surface_beneath_gets_the_light_that_is_in_no_order(variant, table):
    wi, wo, _ = near_orders(200, seed=6)
    si, out = interaction(wi, np.full((len(wi), 4), LAM)), mi.Vector3f(wo.T)
    white = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}
    alone, nested = load(table), load(table, nested=white)
    one = np.array(alone.eval(mi.BSDFContext(), si, out))[0]
    both = np.array(nested.eval(mi.BSDFContext(), si, out))[0]
    m, n = np.mgrid[-4:5, -5:6].reshape(2, -1, 1)
    total = [table.efficiency(*-turned(w, TURN).T, LAM, m, n).sum(axis=0) for w in (wi, wo)]
    beneath = (1.0 - total[0]) * (1.0 - total[1]) * wo[:, 2] / np.pi
    # tables also sum orders just beyond their Rayleigh anomalies: beneath is a little darker
    assert (both - one <= 1.01 * beneath + 0.02).all()
    assert (both - one).sum() == pytest.approx(beneath.sum(), rel=0.3)


@pytest.mark.parametrize("name", ["llvm_ad_spectral", "llvm_ad_rgb"])
def test_the_orientation_has_a_derivative(name, table):
    mi.set_variant(name)
    wi, wo, _ = near_orders(200, seed=5)
    si = interaction(wi, np.full((len(wi), 4), LAM))

    def light(degrees):
        bsdf = load(table, orientation=degrees)
        parameters = mi.traverse(bsdf)
        dr.enable_grad(parameters["orientation"])
        parameters.update()
        value = dr.sum(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T)), axis=None)
        dr.forward(parameters["orientation"])
        return float(np.ravel(value)[0]), float(np.ravel(dr.grad(value))[0])

    (low, _), (_, slope), (high, _) = (light(TURN + step) for step in (-0.05, 0.0, 0.05))
    mi.set_variant("llvm_ad_spectral")
    # single precision, and half floats of a table that is linear between its nodes
    assert slope == pytest.approx((high - low) / 0.1, rel=0.03)
