"""A small scan in the plugin: order 0 has the light's window, other orders that of the scan."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from tests.support.directions import lit_pairs
from tests.support.lanes import brdf_values
from tests.support.patches import SMALL_SCAN

# a small scan is what is tested
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")

MIRROR = {"material": "none", "energy_conserving": False}
SIGMA_0 = 65.0 / 4.0


def load(**parameters):
    return mi.load_dict(md.bsdf_dict(SMALL_SCAN, **parameters))


def pairs_of_the_mirror(count, seed):
    """Directions and wavelengths in the lobe of the light, and elsewhere."""
    wi, wo, lam, near = lit_pairs(SMALL_SCAN, SIGMA_0, count, seed)
    assert near.any()
    return wi, wo, lam, near


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
    wi, wo, lam, near = pairs_of_the_mirror(60, 5)
    conserving = {"energy_conserving": False}
    bsdf = load(**(conserving | parameters))
    if mi.is_rgb:
        pytest.skip("colours are tested below")
    found = brdf_values(bsdf, wi, wo, lam[:, None])
    exact = md.reference.brdf(SMALL_SCAN, wi, wo, lam, **reference)
    factor = kirchhoff_factor(wi, wo, lam, 1.0)
    difference, scale = np.abs(found - exact) / factor, exact / factor
    for part in (near, ~near):
        # the tolerance of the table; roughness as a table adds 1e-3 (`optics.blend`)
        assert difference[part].sum() < 2e-3 * scale[part].sum()
