"""The largest R + T of dielectrics: of what keeps it, and how it grows."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, gratings
from mitsuba_diffraction.tables.energy.sides import largest_sum


def table(depth: float) -> DiffractionTable:
    field = gratings.sinusoidal(2.5, depth, periods=4, pixels_per_period=28)
    return DiffractionTable.build(field, coherence_width=8.0)


@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
def test_a_flat_surface_keeps_all_light(model):
    flat = DiffractionTable.build(HeightField(np.zeros((100, 100)), 0.09), coherence_width=8.0)
    assert largest_sum(flat, 1.0, 1.5, model, False) == pytest.approx(1.0, abs=1e-6)


def test_the_gain_grows_with_the_square_of_the_heights():
    gains = [largest_sum(table(d), 1.0, 1.5, "small_slope", False) - 1.0 for d in (0.02, 0.04)]
    assert gains[0] > 1e-4
    assert gains[1] == pytest.approx(4 * gains[0], rel=0.1)  # and a little of the fourth power


def test_heights_that_are_scaled_are_as_others():
    scaled = largest_sum(table(0.03), 1.4, 1.5, "small_slope", False)
    assert scaled == pytest.approx(
        largest_sum(table(0.042), 1.0, 1.5, "small_slope", False), abs=1e-3
    )


def test_a_sheet_gains_no_more_than_the_dielectric():
    sums = [largest_sum(table(0.06), 1.0, 1.5, "small_slope", thin) for thin in (True, False)]
    assert sums[0] <= sums[1]
