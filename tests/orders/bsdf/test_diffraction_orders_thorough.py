"""The BSDF `diffraction_orders` in all variants: samples, coats, Fresnel's sheet, and blocks."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import OrderTable, reference
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.orders import Band, CellResponse, cells
from mitsuba_diffraction.reference.through import flat_transmittances
from tests.orders.blocks import BLOCK, WIDTH, block_light, indices, near_orders
from tests.support.chi_square import DISPERSED, Case, chi_square
from tests.support.directions import as_single, uniform_directions
from tests.support.orders import (
    PERIOD,
    listed_grating,
    lit_pairs,
    load,
    on_all_sides,
    reference_light,
    thin_grating,
)
from tests.support.variants import evaluate, interaction

pytestmark = pytest.mark.thorough

N = 60
TABLES = {
    "bare": thin_grating(),
    "under a coat": thin_grating(superstrate=1.5),
    "sheet": thin_grating(thin=True),
    "listed": listed_grating(),
    "block": BLOCK,
}


def test_values_under_a_coat_are_the_references(some_variant):
    table = TABLES["under a coat"]
    wi, wo, samples, wavelength = lit_pairs(N)
    values = evaluate(load(table), wi, wo, samples, wavelength)[0]
    expected = reference.orders_brdf(
        table.efficiency, PERIOD, wi, wo, wavelength[:, 0], superstrate=table.superstrate
    )
    expected = expected * wo[:, 2]
    # the grid has the sum of reflections, with a kink at the critical angle of each order
    assert np.abs(values[:, 0] - expected).sum() <= 0.01 * expected.sum()


@pytest.mark.parametrize("name", ["bare", "sheet", "listed"])
def test_every_variant_has_the_same_light(every_variant, name):
    table, n = TABLES[name], 4 if "scalar" in every_variant else 12
    wi, wo, samples, wavelength = lit_pairs(n)
    if table.thin:
        wi, wo = on_all_sides(wi, wo)
    if not mi.is_spectral:
        wavelength = np.full((n, 4), 600.0)
    values, pdf, _, _, _, drawn_pdf, weight = evaluate(
        load(table, wavelength=600.0), wi, wo, samples, wavelength
    )

    lam = np.tile(np.arange(380.5, 780.0), (n, 1)) if mi.is_rgb else wavelength[:, : len(values[0])]
    lanes = np.repeat(wi, lam.shape[1], axis=0), np.repeat(wo, lam.shape[1], axis=0), lam.ravel()
    expected = reference_light(table, *lanes).reshape(lam.shape)
    if mi.is_rgb:
        expected = expected @ linear_srgb(response(lam[0]))
    # interpolation in cells; in RGB variants the efficiency is that at the middle of each lobe,
    # within which it changes by up to a per cent (of constant ones the sum is right to 6e-4)
    tolerance = 1e-2 if mi.is_rgb else 3e-3
    assert np.abs(values - expected).sum() <= tolerance * np.abs(expected).sum()
    assert pdf.min() >= 0.0
    assert np.all(drawn_pdf > 0.0)
    assert np.isfinite(weight).all()


def test_weights_under_a_coat_are_the_albedo(some_variant):
    bsdf = load(TABLES["under a coat"])
    for theta in (0.0, 45.0, 75.0):
        si = interaction(
            np.tile([np.sin(np.radians(theta)), 0.0, np.cos(np.radians(theta))], (4096, 1)),
            np.full((4096, 4), 550.0),
        )
        random = mi.PCG32(size=4096)
        numbers = [random.next_float32() for _ in range(3)]
        _, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
        weights = np.array(weight[0])
        # the lobes are sampled exactly; parts of one may lie beyond the horizon, and under a coat
        # the chances have the face's transmittance interpolated
        assert weights.std() <= (0.2 if theta == 75.0 else 0.1) * weights.mean()


def test_a_mirror_is_that_of_the_plugin_diffraction(some_variant):
    rng = np.random.default_rng(1)
    wi = uniform_directions(N, rng, 0.3)
    wo = -wi + np.column_stack([rng.normal(0.0, 0.004, (N, 2)), np.zeros(N)])
    wo[:, 2] = np.sqrt(1.0 - (wo[:, :2] ** 2).sum(axis=1))
    light = wi, wo, rng.random((N, 3)), as_single(rng.uniform(400.0, 700.0, (N, 4)))
    flat = md.HeightField(np.zeros((8, 8)), 0.2, periodic=True)
    mirror = load(flat, material="none", energy_conserving=False)
    orders = evaluate(load(OrderTable.mirror(PERIOD)), *light)[0]
    # beside the centre of its lobe Kirchhoff's mirror has (1 + ωi·ωo)²/(w² cosθi cosθo)
    assert orders == pytest.approx(evaluate(mirror, *light)[0], rel=5e-3)


@pytest.mark.parametrize(
    ("name", "theta", "side"),
    [
        ("bare", 0.0, 1.0),
        ("bare", 60.0, 1.0),
        ("listed", 35.0, 1.0),
        ("sheet", 30.0, 1.0),
        ("sheet", 30.0, -1.0),
        *(("block", theta, side) for theta in (30.0, 150.0, 110.0) for side in (1.0, -1.0)),
    ],
)
def test_the_density_is_that_of_the_samples(some_variant, name, theta, side):
    # a window of three periods: lobes that overlap, and wide enough for the histogram
    table = TABLES[name]
    bsdf = load(table, coherence_width=3.0 * table.period)
    test = chi_square(bsdf, Case(None, theta, DISPERSED, side=side), samples=1 << 19)
    # 1 % for the cases of a table together; the numbers drawn are always the same
    assert test.run(0.01, 6 if name == "block" else 2, quiet=True), test.messages


def test_light_that_is_in_no_order_goes_on_beneath(some_variant):
    mirror = OrderTable.mirror(PERIOD, 0.8)
    white = {"type": "diffuse", "reflectance": 1.0}
    wi, wo, samples, wavelength = lit_pairs(N)
    alone, over = (
        evaluate(load(mirror, **nested), wi, wo, samples, wavelength)[0]
        for nested in ({}, {"pigment": white})
    )
    # T = 1 - 0.8 of either direction; albedos are rounded up by 0.1 %
    expected = 0.2**2 / np.pi * wo[:, 2:]
    assert over - alone == pytest.approx(np.tile(expected, 4), rel=1e-2, abs=1e-3)


def flat_sheet(index: float) -> OrderTable:
    """Fresnel's sheet, at many nodes."""
    wavelengths = (380.0, 780.0)

    def kind(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        grid = np.meshgrid(*(cells.nodes(n) for n in (10, 8, 4)), indexing="ij")
        tau, rho, w = (part[..., None] for part in grid)
        lam = cells.wavelength_of(k + cells.sine_squared(rho), w, wavelengths, 0.4)
        light = cells.from_cell(k, kind, channels, tau, rho, lam, 0.4)
        cosine = np.sqrt(np.maximum(1.0 - light.x**2 - light.y**2, 0.0))
        through = flat_transmittances(cosine, index, True).mean(axis=0)
        blocks = [[1.0 - through, through], [through, 1.0 - through]]
        each = [[part[..., None] * np.eye(len(channels)) for part in row] for row in blocks]
        values = np.block(each)
        return np.stack([values, 0.0 * values], axis=-1).astype(np.float32)

    last = cells.largest_band(wavelengths, 0.4)
    bands = tuple(
        Band(k, kind(k, cells.A), kind(k, cells.B) if k else None) for k in range(last + 1)
    )
    return OrderTable((0.4, np.inf), wavelengths, CellResponse(bands), thin=True)


def test_a_flat_sheet_passes_on_all_light_as_the_plugin_thindielectric(some_variant):
    solved = load(flat_sheet(1.5))
    plain = mi.load_dict({"type": "thindielectric", "int_ior": 1.5, "ext_ior": 1.0})
    n = 1 << 13
    for theta in (20.0, 110.0, 60.0):
        angle = np.radians(theta)
        wi = np.tile([np.sin(angle) * 0.6, np.sin(angle) * 0.8, np.cos(angle)], (n, 1))
        si = interaction(wi, np.full((n, 4), 550.0))
        random = mi.PCG32(size=n)
        numbers = [random.next_float32() for _ in range(3)]
        passed = []
        for bsdf in (solved, plain):
            sample, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
            weight, below = np.array(weight[0]), np.array(sample.wo.z) * wi[:, 2] < 0.0
            # no light is lost, but for parts of lobes beyond the horizon, and half floats
            assert weight.mean() == pytest.approx(1.0, abs=3e-3)
            passed.append((weight * below).mean())
        # the same numbers; five standard errors of two sums of 2^13 samples
        assert passed[0] == pytest.approx(passed[1], abs=5.0 * np.sqrt(2.0) * 0.5 / np.sqrt(n))


def test_every_variant_has_the_same_light_of_a_block(every_variant):
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
    expected = block_light(wi, wo, orders)
    # half floats, and lobes of 1e-3 in single precision
    assert np.abs(values[:, 0] - ratio * expected).sum() < 3e-3 * expected.sum()
    assert np.abs(pdf - expected).sum() < 3e-3 * expected.sum()
    cross = drawn[:, 2] * wi[:, 2] < 0.0
    lit = drawn_pdf > 0.0
    scale = np.where(cross, (indices(wi) / indices(drawn))[:, 0] ** 2, 1.0)
    assert weight[lit, 0] == pytest.approx(scale[lit], rel=5e-3)


def test_light_of_a_block_in_rgb_variants_is_daylight_s_share(some_variant):
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


def test_derivatives_of_a_block_follow_the_orientation(some_variant):
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
