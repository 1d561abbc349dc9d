"""A small scan in the plugin: colours, densities of samples, and conservation of energy."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from tests.support.chi_square import Case, chi_square
from tests.support.directions import polar
from tests.support.furnace import furnace_in
from tests.support.lanes import evaluated
from tests.support.patches import SMALL_SCAN

# a small scan is what is tested
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]

MIRROR = {"material": "none", "energy_conserving": False}


def load(**parameters):
    return mi.load_dict(md.bsdf_dict(SMALL_SCAN, **parameters))


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


@pytest.mark.parametrize("order", [(0.0, 0.0), None], ids=["its lobe", "everywhere"])
def test_the_density_is_that_of_the_samples(order):
    mi.set_variant("llvm_ad_mono")
    # a histogram of the hemisphere resolves lobes of 12 µm
    width = {"coherence_width": 12.0} if order is None else {}
    case = Case(SMALL_SCAN, 30.0, (550.0,), width, order)
    test = chi_square(case.load(), case, samples=1 << 22)
    assert test.run(0.01, 2, quiet=True), test.messages
    assert test.histogram_sum[0] > 0.01


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
