"""A small scan in the plugin: order 0 has the light's window, other orders that of the scan."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from tests.support.directions import lit_pairs, polar
from tests.support.furnace import furnace_in
from tests.support.lanes import brdf_values, evaluated
from tests.support.patches import SMALL_SCAN

MIRROR = {"material": "none", "energy_conserving": False}
SIGMA_0 = 65.0 / 4.0


def load(**parameters):
    return mi.load_dict(md.bsdf_dict(SMALL_SCAN, **parameters))


@pytest.mark.parametrize(
    ("parameters", "reference"),
    [
        (MIRROR, {}),
        ({"int_ior": 1.5, "ext_ior": 1.0}, {"eta": 1.5}),
        ({"int_ior": 1.5, "ext_ior": 1.0, "coat_ior": 1.3}, {"eta": 1.5, "coat": 1.3}),
    ],
    ids=["mirror", "dielectric", "coat"],
)
def test_values_are_those_of_the_model(some_variant, parameters, reference):
    wi, wo, lam, near = lit_pairs(SMALL_SCAN, SIGMA_0, 60, 5)
    assert near.any()
    conserving = {"energy_conserving": False}
    bsdf = load(**(conserving | parameters))
    found = brdf_values(bsdf, wi, wo, lam[:, None])
    exact = md.reference.brdf(SMALL_SCAN, wi, wo, lam, **reference)
    factor = kirchhoff_factor(wi, wo, lam, 1.0)
    difference, scale = np.abs(found - exact) / factor, exact / factor
    for part in (near, ~near):
        # the tolerance of the table; roughness as a table adds 1e-3 (`optics.blend`)
        assert difference[part].sum() < 2e-3 * scale[part].sum()


@pytest.mark.thorough
def test_colours_are_those_of_the_wavelengths():
    mi.set_variant("llvm_ad_rgb")
    bsdf = load(**MIRROR)
    table = bsdf.table
    lam = np.arange(376.0, 744.0, 0.5) + 0.25
    weights = linear_srgb(response(lam))
    weights /= weights.sum(axis=0)
    for theta in (0.3, 1.0, 20.0):
        wi, wo = polar(30.0, 180.0), polar(30.0 + theta, 0.0)
        exact = table.brdf(np.tile(wi, (lam.size, 1)), wo, lam) @ weights * wo[2]
        found = np.array(evaluated(bsdf, wi, wo, 550.0)).ravel()[:3]
        # linear between 256 radii of the lobe, and eight digits of the sums
        assert found == pytest.approx(exact, rel=0.02, abs=2e-3 * np.abs(exact).max())


@pytest.mark.thorough
@pytest.mark.parametrize(
    "parameters",
    [
        {"material": "none"},
        {"material": "Al"},
        {"material": "Al", "coat_ior": 1.5},
        {"plugin": "diffraction_dielectric", "int_ior": 1.5},
        {"plugin": "diffraction_dielectric", "int_ior": 1.5, "thin": True},
    ],
    ids=lambda parameters: ", ".join(map(str, parameters.values())),
)
def test_no_more_light_leaves_than_arrives(parameters):
    mi.set_variant("llvm_ad_mono")
    directions = np.array([polar(theta, 30.0) for theta in (0.0, 30.0, 60.0, 75.0, 84.0, 88.0)])
    mean, error = furnace_in(load(**parameters), directions, 1)
    assert np.all(mean <= 1.0 + 4.0 * error + 2e-3), mean
    # a window of another width moves light within lobes, far from the horizon
    array = md.HeightField(SMALL_SCAN.heights, SMALL_SCAN.pixel_size)
    one_window = mi.load_dict(md.bsdf_dict(array, coherence_width=4.8, **parameters))
    others, _ = furnace_in(one_window, directions[:2], 1)
    np.testing.assert_allclose(mean[:, :2], others, atol=0.02)
