"""Bands fill the range of wavelengths."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.analysis.maps import Bands


@given(st.floats(0.1, 500), st.floats(300, 500), st.floats(0.1, 500))
def test_bands_fill_the_range_and_are_no_wider_than_the_step(step, low, extent):
    extent = (low + extent) - low  # as rounding leaves it
    if step > extent:
        with pytest.raises(DiffractionError, match="step="):
            Bands(low, low + extent, step)
        return
    bands = Bands(low, low + max(extent, 1.000001 * step), step)
    assert bands.width <= step * (1 + 1e-9)
    np.testing.assert_allclose(bands.wavelengths(0.0)[0], low)
    np.testing.assert_allclose(bands.wavelengths(1.0)[-1], bands.high)


def test_five_nanometres_are_ninety_four_bands():
    assert Bands(360, 830).count == 94
    assert Bands(380, 780, 0.1).count == 4000  # not one more by rounding
