"""Tables of crossed gratings, solved on several processes."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.orders.solve.jobs import processes

pytestmark = pytest.mark.thorough

PIXELS = 24
Y, X = np.mgrid[:PIXELS, :PIXELS] / PIXELS


def test_a_table_of_bumps_says_its_errors():
    heights = 0.021 * (np.cos(2 * np.pi * X) + np.cos(2 * np.pi * Y))
    with processes(2) as executor:
        table = md.solve_crossed(
            HeightField(heights, 0.55 / PIXELS), 1.5, wavelengths=(500.0, 540.0), step=20.0,
            theta_step=30.0, phi_step=45.0, harmonics=2, slices=2, executor=executor,
        )  # fmt: skip
    assert table.response.orders.max() == 2
    assert 0.0 < table.header["error_mean"] < 0.3  # coarse steps
    assert table.header["solver_error"] < 0.2
    normal = table.efficiency(0.0, 0.0, 520.0, [1, 0, -1, 0], [0, 1, 0, -1])
    assert normal == pytest.approx(normal[0], rel=1e-3)
