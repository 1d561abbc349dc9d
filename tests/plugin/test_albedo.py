"""What denoisers ask for: a colour that does not depend on where it is seen from."""

from __future__ import annotations

import numpy as np
import pytest

from tests.directions import polar
from tests.lanes import interaction, spectra
from tests.plugin.gentle import load

PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.5}}


def albedo(bsdf, theta):
    return spectra(bsdf.eval_diffuse_reflectance(interaction(polar(theta), 550.0)))[0]


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
    bsdf = load(**surface)
    found = np.array([albedo(bsdf, theta) for theta in (0.0, 30.0, 60.0)])
    assert found == pytest.approx(expected, abs=0.01)
    assert np.ptp(found, axis=0) == pytest.approx(0.0, abs=1e-6)
