"""The BSDF `diffraction_orders`: its light is that of the table, of gratings and of sheets."""

from __future__ import annotations

import itertools

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.coat import face_transmittance
from mitsuba_diffraction.orders import OrderTable
from tests.orders.blocks import BLOCK, near_orders
from tests.support import crossed
from tests.support.directions import polar
from tests.support.furnace import furnace_in
from tests.support.orders import (
    PERIOD,
    listed_grating,
    lit_pairs,
    load,
    on_all_sides,
    reference_light,
    thin_grating,
)
from tests.support.variants import evaluate

TABLE, SHEET, LISTED = thin_grating(), thin_grating(thin=True), listed_grating()


@pytest.mark.parametrize("table", [TABLE, SHEET, LISTED], ids=["grating", "sheet", "listed"])
def test_values_are_the_references_and_weights_the_albedo(some_variant, table):
    wi, wo, samples, wavelength = lit_pairs(80)
    wavelength[:] = wavelength[:, :1]
    if table.thin:
        wi, wo = on_all_sides(wi, wo)
    found = evaluate(load(table), wi, wo, samples, wavelength)
    values, pdf, again, pdf_again, drawn, _, weights = found
    expected = reference_light(table, wi, wo, wavelength[:, 0])
    # linear interpolation between the corners of cells
    assert np.abs(values[:, 0] - expected).sum() <= 1e-3 * expected.sum()
    assert np.array_equal(values, again)
    assert np.array_equal(pdf, pdf_again)
    sides, steps = (False, True)[: table.sides], np.arange(-5, 6)[:, None]
    albedo = sum(
        np.where(
            (wi[:, 2] < 0.0) == from_below,
            table.efficiency(
                -wi[:, 0], -wi[:, 1], wavelength[:, 0], steps,
                from_below=from_below, transmitted=transmitted,
            ).sum(axis=0),
            0.0,
        )
        for from_below, transmitted in itertools.product(sides, sides)
    )  # fmt: skip
    # drawn exactly: half floats are rounded up
    valid = weights[:, 0] > 0.0
    assert valid.mean() > 0.9
    far = valid & (np.minimum(np.abs(wi[:, 2]), np.abs(drawn[:, 2])) > 0.2)  # where C is 1
    assert far.mean() > 0.7
    assert weights[far, 0] == pytest.approx(albedo[far], rel=3e-3)
    passed = 0.72 if table.thin else 0.0
    assert (drawn[valid, 2] * wi[valid, 2] < 0.0).mean() == pytest.approx(passed, abs=0.15)


def test_light_from_a_listed_direction_is_seen_from_all_directions(some_variant):
    """A camera looks along ωi, and light comes along ωo: by reciprocity it has the list's light."""
    orders, lam = np.array([-1, 1, 2, 3]), 580.0  # a listed wavelength
    sine = np.sin(np.radians(20.0))
    lamp = np.tile(polar(20.0, 0.0), (len(orders), 1))
    across = orders * lam / (1e3 * PERIOD) - sine
    seen = np.column_stack([across, 0.0 * across, np.sqrt(1.0 - across**2)])
    light = np.zeros((len(orders), 3)), np.full((len(orders), 4), lam)
    table = load(LISTED, wavelength=lam)
    forth = evaluate(table, lamp, seen, *light)[0] / seen[:, 2:]
    back = evaluate(table, seen, lamp, *light)[0] / lamp[:, 2:]
    assert back == pytest.approx(forth, rel=5e-3 if mi.is_rgb else 1e-3)
    # the list's light, but for half floats
    truth = TABLE.efficiency(-sine, 0.0, lam, orders)
    assert LISTED.efficiency(-sine, 0.0, lam, orders) == pytest.approx(truth, rel=2e-3)
    assert LISTED.efficiency(-across, 0.0, lam, orders) == pytest.approx(truth, rel=2e-3)


@pytest.mark.parametrize("component", [0, 1])
@pytest.mark.parametrize("table", [SHEET, BLOCK], ids=["sheet", "block"])
def test_a_component_is_the_light_of_its_side(some_variant, table, component):
    wi, wo, samples, wavelength = lit_pairs(40)
    wi, wo = on_all_sides(wi, wo)
    if table is BLOCK:
        (wi, wo, _), wavelength[:] = near_orders(40), 550.0
    bsdf = load(table)
    assert mi.has_flag(bsdf.flags(), mi.BSDFFlags.GlossyTransmission)
    whole = evaluate(bsdf, wi, wo, samples, wavelength)[0]
    part = evaluate(bsdf, wi, wo, samples, wavelength, component)
    passed = wi[:, 2] * wo[:, 2] < 0.0
    assert np.array_equal(part[0], np.where((passed == component)[:, None], whole, 0.0))
    sides = part[4][:, 2] * wi[:, 2] < 0.0
    assert np.all(part[5][sides != component] == 0.0)


def test_a_flat_mirror_keeps_its_light_up_to_the_horizon(some_variant):
    """Order 0 alone: all of its lobe is above the surface."""
    reflectance = 0.9
    table = OrderTable.mirror(PERIOD, reflectance, (360.0, 830.0))
    directions = np.array([polar(theta, 20.0) for theta in (0.0, 60.0, 80.0, 85.0, 88.0)])
    mean, error = furnace_in(load(table), directions, 1)
    # rows of half floats, and the fit of C
    assert np.all(np.abs(mean - reflectance) < 4.0 * error + 3e-3), mean


def test_a_perfect_mirror_under_a_layer_reflects_all_light(some_variant):
    """Its look-up is between cells' corners beyond the critical angle, where reflections add up."""
    table = OrderTable.mirror(PERIOD, 1.0, (360.0, 830.0), superstrate=1.5)
    directions = np.array([polar(theta, 20.0) for theta in (0.0, 60.0, 80.0, 83.0, 85.0, 88.0)])
    mean, error = furnace_in(load(table), directions, 1)
    assert np.all(np.abs(mean - 1.0) < 4.0 * error + 5e-3), mean


@pytest.mark.parametrize("reflectance", [0.3, 0.9])
def test_a_mirror_under_a_layer_reflects_what_both_faces_do(some_variant, reflectance):
    table = OrderTable.mirror(PERIOD, reflectance, (360.0, 830.0), superstrate=1.5)
    angles = np.array([0.0, 45.0, 60.0, 75.0, 80.0, 85.0])
    mean, error = furnace_in(load(table), np.array([polar(theta, 20.0) for theta in angles]), 1)
    passed = face_transmittance(np.cos(np.radians(angles)), np.float64(1.5))
    both = 1.0 - passed + passed**2 * reflectance / (1.0 - (1.0 - passed) * reflectance)
    assert np.all(np.abs(mean - both) < 4.0 * error + 5e-3), mean / both


@pytest.mark.parametrize(
    ("table", "parameters", "message"),
    [
        (TABLE, {"coherence_width": 2.0}, "periods"),
        (TABLE, {"orientations": 1.0}, "orientation"),
        (TABLE, {"coat_ior": 1.5}, "is a parameter of the plugin 'diffraction'"),
        (SHEET, {"beneath": {"type": "diffuse"}}, "thin sheet"),
        (BLOCK, {"beneath": {"type": "diffuse"}}, "block, beneath"),
        (crossed.table(), {"film_ior": 1.3}, "film_ior"),
        (crossed.table(), {"height_scale": 1.3}, "height_scale"),
        (crossed.table(), {"lateral_scale": 1.3}, "lateral_scale"),
    ],
)
def test_unfit_parameters_are_refused_in_one_line(some_variant, table, parameters, message):
    with pytest.raises(Exception, match=message) as caught:
        load(table, **parameters)
    assert isinstance(caught.value.__cause__ or caught.value, (DiffractionError, RuntimeError))


def test_files_are_loaded_by_name(some_variant, tmp_path):
    path = tmp_path / "grating.nc"
    thin_grating(0.6, counts=(2, 2, 1)).save(path)
    bsdf = mi.load_dict({"type": "diffraction_orders", "filename": str(path)})
    assert "0.6 µm" in str(bsdf)
    with pytest.raises(Exception, match="does not exist"):
        mi.load_dict({"type": "diffraction_orders", "filename": str(tmp_path / "none.nc")})


def test_in_colours_grazing_light_of_a_mirror_is_reciprocal():
    mi.set_variant("scalar_rgb")
    bsdf, si, context = load(OrderTable.mirror(0.6)), mi.SurfaceInteraction3f(), mi.BSDFContext()
    values = []
    for came, left in ((80.0, 83.0), (83.0, 80.0)):
        si.wi, wo = (mi.Vector3f(*polar(*each).tolist()) for each in ((came, 0), (left, 180)))
        values.append(np.ravel(bsdf.eval(context, si, wo)) / wo.z)
    assert values[0] == pytest.approx(values[1], rel=1e-5)
    assert values[0].min() > 0.0
