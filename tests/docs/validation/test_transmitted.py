"""Transmitted orders of gratings, beside Rayleigh's expansion."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import rayleigh, transmitted
from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.reference import boundary
from tests.support.directions import polar

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("grating", transmitted.GRATINGS[:4], ids=str)
def test_colours_of_gratings_of_slope_up_to_a_tenth(grating):
    for azimuth in transmitted.AZIMUTHS:
        assert transmitted.deviation(grating, 0.0, azimuth, "small_slope") < 0.002
        for theta in transmitted.ANGLES[1:]:
            assert transmitted.deviation(grating, theta, azimuth, "small_slope") < 0.03


def test_on_a_surface_without_symmetry_orders_are_on_their_own_side():
    x = np.arange(64) / 64 * 2 * np.pi
    heights = 0.03 * np.cos(x) + 0.012 * np.sin(2 * x)
    field, wi = HeightField(np.tile(heights, (2, 1)), 2.5 / 64), polar(0.0)
    solution = rayleigh.through(field, 1.56, 550.0, wi, 31)
    exact = boundary.unpolarised(solution.jones) * -1.56 * solution.wo[:, 2]
    per_btdf = np.pi / (2.5 * 2 * np.pi / 0.55) ** 2
    model = per_btdf * reference.btdf(field, wi, solution.wo, 550.0, eta=1.56, coherence_width=10.0)
    first = {int(m): n for n, m in enumerate(solution.order[:, 0])}
    assert exact[first[1]] > 1.1 * exact[first[-1]]  # the sides differ
    for order in (-1, 1):
        assert model[first[order]] == pytest.approx(exact[first[order]], rel=2e-3)
