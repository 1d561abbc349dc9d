"""What denoisers ask for: a colour that does not depend on where it is seen from."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import polar
from tests.support.gentle import load
from tests.support.lanes import interaction, spectra
from tests.support.variants import obstacle

pytestmark = pytest.mark.thorough

PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}


def albedo(bsdf, theta):
    return spectra(bsdf.eval_diffuse_reflectance(interaction(polar(theta), 550.0)))[0]


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        ({"material": "none"}, 1.0),
        ({"int_ior": 1.5}, 0.04),
        ({"material": "Al"}, 0.92),
        ({"int_ior": 1.5, "beneath": PIGMENT}, 0.04 + 0.5 * 0.96**2),
        ({"int_ior": 1.5, "beneath": {"type": "roughconductor", "alpha": 0.01}}, 1.0),
    ],
)
def test_it_is_the_same_from_all_sides_and_at_most_1(variant, surface, expected):
    if reason := obstacle(variant):
        pytest.skip(reason)
    mi.set_variant(variant)
    bsdf = load(**surface)
    found = np.array([albedo(bsdf, theta) for theta in (0.0, 30.0, 60.0)])
    assert np.all((found >= 0.0) & (found <= 1.0))
    assert found == pytest.approx(expected, abs=0.01)
    assert np.ptp(found, axis=0) == pytest.approx(0.0, abs=1e-6)
