"""Functions of direction: interpolation on the grid, and around it."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.tables.directional import LAST_ANGLE, DirectionGrid


def test_the_grid_interpolates_what_is_linear_and_goes_round():
    grid = DirectionGrid(10, 12)
    assert grid.theta[0] == 0.0
    assert grid.theta[-1] == pytest.approx(LAST_ANGLE)
    rows = np.arange(11.0, dtype=np.float32)[:, None] + np.zeros((1, 12), np.float32)
    theta = np.radians([0.0, 10.0, 47.0, 89.9])
    found = grid.interpolation(theta, np.radians([-30.0, 0.0, 359.0, 725.0]))(rows)
    assert found == pytest.approx(grid.row(theta), abs=1e-5)
    round_ = np.cos(grid.phi).astype(np.float32) + np.zeros((11, 1), np.float32)
    middle = grid.interpolation(0.5, np.radians([345.0, -15.0]))(round_)
    assert middle == pytest.approx(0.5 * (1.0 + np.cos(np.radians(30.0))), abs=1e-6)
