"""Tables of patches of all shapes can be looked up, in all variants."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.device_table import _UNROLLED_TAPS, device_table
from tests.support.directions import rough_patch

pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")


def test_many_bins_in_few_rows_are_read_in_a_loop(some_variant):
    """Where no corners are left out either: rows then are variables, and so are their weights."""
    field = rough_patch((32, 72), (0.13, 0.13), 0.1)
    table = md.DiffractionTable.build(
        field, coherence_width=3.3, tolerance=1e-4, wavelength_range=(500, 600)
    )
    assert table.grid.taps_read > _UNROLLED_TAPS
    assert table.grid.taps[1] <= 6
    assert not table.grid.trims
    q = (0.3, 0.2, 15.0)
    found = device_table(table).window_sum(*map(mi.Float, q))
    assert np.array(found) == pytest.approx(table.window_sum(*map(np.atleast_1d, q)), rel=1e-3)
