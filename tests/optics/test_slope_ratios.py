"""Slopes of a surface and their gate; the cells' sums are tested with the tables that hold them."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.slope_ratios import Slopes, along
from tests.support.directions import rough_patch


def test_slopes_are_the_surface_s_and_the_gate_shuts_at_walls():
    x = 2 * np.pi * np.arange(64) / 64
    gentle = Slopes.from_heights(0.05 * np.sin(x)[None, :] * np.ones((8, 1)), (2.5 / 64, 0.1))
    q = 2 * np.pi / 2.5
    slope = 0.05 * q * np.cos(x) / (1 + (q / 23) ** 2)
    assert gentle.products[0] == pytest.approx(np.tile(slope**2, (8, 1)), abs=1e-12)
    assert gentle.products[1:] == pytest.approx(0.0, abs=1e-12)
    assert gentle.gate > 0.98
    wall = np.tile(0.1 * (x < np.pi), (8, 1))
    # ρ falls with the pixels, as the walls' own slopes grow
    coarse, fine = (Slopes.from_heights(wall, (dx / 64, 0.1)).gate for dx in (2.5, 0.25))
    assert coarse > fine < 0.1
    assert Slopes.from_heights(np.zeros((8, 8)), (0.1, 0.1)).products == pytest.approx(0.0)


def test_along_and_across_turn_with_the_order():
    patch = rough_patch((12, 15), (0.13, 0.15), 0.3)
    products = Slopes.from_heights(patch.heights, patch.pixel_size).products.reshape(3, -1).T
    q = np.array([0.6, 0.8])
    lengthwise, across = along(np.broadcast_to(q, (len(products), 2)), products + 0j).T
    assert lengthwise + across == pytest.approx(products[:, 0] + products[:, 2])
    x, _ = along(np.tile([2.0, 0.0], (len(products), 1)), products + 0j).T
    assert x == pytest.approx(products[:, 0])
    expected = products @ [0.36, 0.96, 0.64]
    assert lengthwise == pytest.approx(expected)
