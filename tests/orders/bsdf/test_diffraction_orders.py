"""The BSDF `diffraction_orders`: lists, mirrors, what lies beneath, files, and refusals."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.optics.coat import face_transmittance
from mitsuba_diffraction.orders import OrderTable
from tests.orders.kinds import KINDS, albedo_of, loaded, near_orders
from tests.support.directions import polar
from tests.support.furnace import furnace_in
from tests.support.lanes import evaluated
from tests.support.orders import PERIOD, load, thin_grating
from tests.support.variants import evaluate

WHITE = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}
#: Relative errors of rows of the sums of efficiencies.
BENEATH = {"grooves": 0.05, "crossed": 0.3}


def test_light_from_a_listed_direction_is_seen_from_all_directions(some_variant):
    """A camera looks along ωi, and light comes along ωo: by reciprocity it has the list's light."""
    orders, lam = np.array([-1, 1, 2, 3]), 580.0  # a listed wavelength
    sine = np.sin(np.radians(20.0))
    lamp = np.tile(polar(20.0, 0.0), (len(orders), 1))
    across = orders * lam / (1e3 * PERIOD) - sine
    seen = np.column_stack([across, 0.0 * across, np.sqrt(1.0 - across**2)])
    light = np.zeros((len(orders), 3)), np.full((len(orders), 4), lam)
    listed = KINDS["listed"]()
    table = load(listed, wavelength=lam)
    forth = evaluate(table, lamp, seen, *light)[0] / seen[:, 2:]
    back = evaluate(table, seen, lamp, *light)[0] / lamp[:, 2:]
    assert back == pytest.approx(forth, rel=5e-3 if mi.is_rgb else 1e-3)
    # the list's light, but for half floats
    truth = KINDS["grooves"]().efficiency(-sine, 0.0, lam, orders)
    for x in (sine, across):
        assert listed.efficiency(-x, 0.0, lam, orders) == pytest.approx(truth, rel=2e-3)


@pytest.mark.parametrize(
    ("superstrate", "reflectance"), [(1.0, 0.9), (1.5, 0.3), (1.5, 0.9), (1.5, 1.0)]
)
def test_a_mirror_under_a_layer_reflects_what_both_faces_do(some_variant, superstrate, reflectance):
    """All light of order 0 is above the surface, up to the horizon.

    A perfect mirror's look-up is between cells' corners beyond the critical angle, where
    reflections add up.
    """
    table = OrderTable.mirror(PERIOD, reflectance, (360.0, 830.0), superstrate=superstrate)
    angles = np.array([0.0, 45.0, 60.0, 75.0, 80.0, 83.0, 85.0, 88.0])
    mean, error = furnace_in(load(table), np.array([polar(theta, 20.0) for theta in angles]), 1)
    passed = face_transmittance(np.cos(np.radians(angles)), np.float64(superstrate))
    both = 1.0 - passed + passed**2 * reflectance / (1.0 - (1.0 - passed) * reflectance)
    # rows of half floats, and the fit of C
    assert np.all(np.abs(mean - both) < 4.0 * error + 5e-3), mean / both


@pytest.mark.parametrize("kind", ["grooves", "crossed"])
def test_a_surface_beneath_gets_the_light_that_is_in_no_order(some_variant, kind):
    table = KINDS[kind]()
    wi, wo, _, lam = near_orders(table, 200)
    bsdfs = loaded(kind), loaded(kind, pigment=WHITE)
    alone, over = (evaluated(bsdf, wi, wo, lam) for bsdf in bsdfs)
    left = [1.0 - albedo_of(table, w, lam[:, 0]) for w in (wi, wo)]
    expected = left[0] * left[1] * wo[:, 2] / np.pi
    found = (over - alone)[:, 0]
    # tables also sum orders just beyond their Rayleigh anomalies: beneath is a little darker
    assert np.all(found <= 1.01 * expected + 0.02)
    assert found.sum() == pytest.approx(expected.sum(), rel=BENEATH[kind])


def test_files_are_loaded_by_name(some_variant, tmp_path):
    path = tmp_path / "grating.nc"
    thin_grating(0.6, counts=(2, 2, 1)).save(path)
    bsdf = mi.load_dict({"type": "diffraction_orders", "filename": str(path)})
    assert "0.6 µm" in str(bsdf)


def test_in_colours_grazing_light_of_a_mirror_is_reciprocal():
    mi.set_variant("scalar_rgb")
    bsdf, si, context = load(OrderTable.mirror(0.6)), mi.SurfaceInteraction3f(), mi.BSDFContext()
    values = []
    for came, left in ((80.0, 83.0), (83.0, 80.0)):
        si.wi, wo = (mi.Vector3f(*polar(*each).tolist()) for each in ((came, 0), (left, 180)))
        values.append(np.ravel(bsdf.eval(context, si, wo)) / wo.z)
    assert values[0] == pytest.approx(values[1], rel=1e-5)
    assert values[0].min() > 0.0
