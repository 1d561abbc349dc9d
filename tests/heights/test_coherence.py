"""The coherence width fits the patch, unless the surface itself repeats; wider windows are said."""

from __future__ import annotations

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.coherence import (
    repeats,
    resolved,
    resolved_width,
    widest_window,
    window_warning,
)
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.settings import USUAL_WIDTH, TableSettings

SIDES = st.integers(2, 40)
PIXELS = st.floats(0.01, 20.0)
RNG = np.random.default_rng(0)


def scan(nx=64, ny=64, pixel_size=0.1, **flags):
    heights = 0.02 * RNG.standard_normal((ny, nx))
    return HeightField(heights, pixel_size, name="scan", cut_out=True, **flags)


@given(SIDES, SIDES, PIXELS, PIXELS)
def test_the_window_is_as_wide_as_the_smaller_side_and_at_most_as_sunlight(nx, ny, dx, dy):
    field = scan(nx, ny, (dx, dy))
    assert resolved_width("auto", [field]) == min(USUAL_WIDTH, nx * dx, ny * dy)
    assert resolved_width("auto", [field, scan(2, 2, 0.4)]) == min(
        USUAL_WIDTH, nx * dx, ny * dy, 0.8
    )


@given(SIDES, SIDES, PIXELS, PIXELS)
def test_a_side_without_any_change_of_height_is_no_limit(nx, ny, dx, dy):
    rows = HeightField(np.tile(RNG.standard_normal(nx), (ny, 1)), (dx, dy))
    assert widest_window([rows]) == nx * dx
    columns = HeightField(np.tile(RNG.standard_normal((ny, 1)), nx), (dx, dy))
    assert widest_window([columns]) == ny * dy
    assert resolved_width("auto", [HeightField(np.zeros((ny, nx)), (dx, dy))]) == USUAL_WIDTH


@given(st.floats(0.1, 500.0), st.floats(0.1, 500.0))
def test_a_window_is_warned_of_if_and_only_if_the_repetition_shows(side, width):
    field = scan(16, 16, side / 16)
    assert repeats(width, [field]) == (widest_window([field]) < 0.9 * width)
    if side >= 1.0:
        assert bool(window_warning(width, [field])) == repeats(width, [field])
    assert window_warning(resolved_width("auto", [field]), [field]) == "" or side < 1.0


@pytest.mark.parametrize("periods", [1, 8])
@pytest.mark.parametrize("kind", [gratings.sinusoidal, gratings.blazed, gratings.lamellar])
def test_gratings_keep_the_usual_window_without_a_warning(kind, periods):
    grating = kind(1.6, 0.1, periods=periods)
    assert resolved_width("auto", [grating]) == USUAL_WIDTH
    assert window_warning(100.0, [grating]) == ""
    assert resolved_width("auto", [grating.treated(level="plane")]) == USUAL_WIDTH
    cropped = grating.treated(crop=0.9)
    assert resolved_width("auto", [cropped]) == pytest.approx(0.9)


@pytest.mark.parametrize("width", ["auto", 65.0, 30.0])
def test_a_scan_limits_the_window_of_its_orders_and_not_the_light_s(width):
    scanned = scan().changed(scan().heights, "cut out", cut_out=True)
    limited = resolved(TableSettings(coherence_width=width), [scanned])
    assert limited.coherence_width == (USUAL_WIDTH if width == "auto" else width)
    assert limited.width == limited.window_width == min(scanned.extent)
    assert resolved(limited, [scanned]) == limited
    wide = scanned.treated(periodic="exact")
    assert resolved(limited, [wide]).window_width is None
