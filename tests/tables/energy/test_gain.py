"""Factors of the orders' powers: what tables between directions hold is the boundary's own."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.blend import ScaleRoughness
from mitsuba_diffraction.optics.paths import Path
from mitsuba_diffraction.tables.directional import LAST_ANGLE, DirectionGrid
from mitsuba_diffraction.tables.energy.conserved import Transmitter
from mitsuba_diffraction.tables.energy.gain import PathGain
from tests.support.directions import rough_patch


def test_heights_scaled_alike_have_the_same_gain():
    patch = rough_patch((40, 44), (0.09, 0.09), 0.1)
    light = np.array(0.7), np.array(0.5), 0.3
    gains = [
        PathGain(Path(0.9 + 6.0j, "small_slope"), roughness.table(50.0), 11.0, scale).exact(*light)
        for heights, scale in ((patch.heights, 1.5), (1.5 * patch.heights, 1.0))
        for roughness in [ScaleRoughness.from_heights(heights, patch.pixel_size)]
    ]
    assert gains[0] == pytest.approx(gains[1])


PATHS = [
    pytest.param(path, id=f"{name} {path.came.number}-{path.left.number}")
    for name, thin in (("surface", False), ("sheet", True))
    for path in Transmitter(1.5, "small_slope", thin).paths(np.ones(1), 1e-3)[0]
    if path.index is not None  # the flat side of a sheet has no table
] + [pytest.param(Path(0.9 + 6.0j, "small_slope"), id="metal")]


@pytest.mark.parametrize("path", PATHS)
def test_tables_hold_the_boundary_s_gain_in_either_order_of_directions(path):
    patch = rough_patch((40, 44), (0.09, 0.09), 0.1)
    exact = ScaleRoughness.from_heights(patch.heights, patch.pixel_size)
    gain = PathGain(path, exact.table(50.0), 11.0, 1.0)
    rng = np.random.default_rng(4)
    cos_i, cos_o = rng.uniform(0.4, 0.98, (2, 400))
    turn = rng.uniform(-np.pi, np.pi, 400)
    expected, tabulated = (
        gain.exact(cos_i, cos_o, np.cos(turn)),
        gain(cos_i, np.arange(400), cos_o, turn),
    )
    near = path.tangential(cos_i, cos_o, np.cos(turn)) < 1.9
    # linear between 37 × 37 × 25 nodes, within 73 × 73 × 25; where w is small, 1/w² is not linear
    away = near & (path.width(cos_i, cos_o) > 0.2)
    assert np.count_nonzero(away) > 150
    error = np.abs(tabulated - expected)[away].sum() / expected[away].sum()
    # 1.2 % where total reflection begins at a kink, 1.6 % within with 37 × 37 × 25 nodes
    assert error < 0.014


@pytest.mark.parametrize("index", [1.5, 2.46])
def test_tables_hold_the_root_at_a_critical_angle(index):
    """Light is let through towards directions within 3° of the critical angle."""
    patch = rough_patch((40, 44), (0.09, 0.09), 0.1)
    exact = ScaleRoughness.from_heights(patch.heights, patch.pixel_size)
    path = Transmitter(index, "small_slope", False).paths(np.array([550.0]), 0.05)[0][1]
    gain = PathGain(path, exact.table(50.0), 11.0, 1.0)
    critical = np.arcsin(1.0 / index)
    cos_o = np.cos(np.linspace(critical - 0.05, critical + 0.05, 41))
    cos_i, row = np.array([np.cos(1.1)]), np.zeros(41, int)
    expected = gain.exact(cos_i, cos_o, np.full(41, -0.95))
    tabulated = gain(cos_i, row, cos_o, np.full(41, np.arccos(-0.95)))
    # up to 0.11 where nodes were the same for all sides
    np.testing.assert_allclose(tabulated, expected, rtol=0.02)


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
