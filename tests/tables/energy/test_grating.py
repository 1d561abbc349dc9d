"""Which orders are those of a grating."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.tables.energy.grating import on_one_line


@pytest.fixture(scope="module")
def table() -> DiffractionTable:
    heights = md.gratings.sinusoidal(1.6, 0.1, periods=4, pixels_per_period=16)
    return DiffractionTable.build(heights, coherence_width=6.0)


@pytest.mark.parametrize(
    ("bins", "first"),
    [
        ([], None),
        ([[0, 0]], None),
        ([[0, 0], [4, 0], [-4, 0], [12, 0]], [4, 0]),
        ([[-12, 0], [0, 0], [8, 0]], [4, 0]),
        ([[0, 0], [4, 4], [-8, -8]], [4, 4]),
        ([[4, 0], [0, 4]], None),
        ([[0, 0], [4, 1], [8, 1]], None),
    ],
)
def test_orders_of_a_grating_lie_on_one_line(table, bins, first):
    found = on_one_line(table, np.array(bins, np.int64).reshape(-1, 2))
    if first is None:
        assert found is None
    else:
        expected = np.abs(np.array(first) * table.spacing)
        assert_allclose(np.abs(found.axis) * found.spacing, expected)
