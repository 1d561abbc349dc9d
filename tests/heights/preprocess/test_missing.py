"""Points without data are filled from the points around, or refused."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.preprocess import FILLS, fill_missing


def gaps(heights, seed=0):
    """The heights with a disc, a corner and single points taken out."""
    ny, nx = heights.shape
    y, x = np.mgrid[0:ny, 0:nx]
    lost = np.hypot(y - ny / 2, x - nx / 2) < min(ny, nx) / 5
    lost |= (y < 4) & (x < 5)
    lost |= np.random.default_rng(seed).random(heights.shape) < 0.02
    return np.where(lost, np.nan, heights)


@pytest.mark.parametrize("method", FILLS)
def test_measured_points_stay_and_gaps_stay_within_their_range(method):
    whole = np.random.default_rng(3).random((40, 50))
    holed = gaps(whole)
    filled, line = fill_missing(holed, method, "patch")
    measured = ~np.isnan(holed)
    assert np.array_equal(filled[measured], whole[measured])
    assert np.isfinite(filled).all()
    # a nearest point is a measured one, and a membrane obeys the maximum principle
    assert filled.min() >= whole[measured].min() - 1e-8
    assert filled.max() <= whole[measured].max() + 1e-8
    assert str((~measured).sum()) in line
    assert method in line


def test_harmonic_continues_a_plane_through_inner_gaps():
    y, x = np.mgrid[0:40, 0:50]
    plane = 0.1 * x - 0.05 * y + 3
    holed = np.where(np.hypot(y - 20, x - 25) < 8, np.nan, plane)
    filled, _ = fill_missing(holed, "harmonic", "patch")
    # a plane is harmonic; conjugate gradients stop at 1e-9 of the heights' norm, about 50
    assert filled == pytest.approx(plane, abs=1e-6)


def test_nearest_takes_the_nearest_height():
    row = np.array([1.0, 1.0, np.nan, np.nan, np.nan, 2.0, 2.0])
    filled, _ = fill_missing(np.tile(row, (2, 1)), "nearest", "patch")
    assert filled[:, [2, 4]].tolist() == [[1, 2], [1, 2]]
    assert set(filled[:, 3]) <= {1, 2}


def test_complete_heights_pass_untouched():
    whole = np.ones((3, 4))
    filled, line = fill_missing(whole, None, "patch")
    assert filled is whole
    assert line == ""


def test_a_wide_gap_is_filled():
    whole = np.add.outer(np.sin(np.arange(200) / 20), np.cos(np.arange(200) / 30))
    holed = whole.copy()
    holed[30:165, 30:165] = np.nan  # 46 % of the patch
    filled, _ = fill_missing(holed, "harmonic", "patch")
    assert np.isfinite(filled).all()


@pytest.mark.parametrize(
    ("share", "method", "word"),
    [(0.1, None, "fill"), (0.7, "harmonic", "too many"), (1, "nearest", "empty")],
)
def test_what_cannot_be_filled_is_refused(share, method, word):
    heights = np.ones((10, 10))
    heights.ravel()[: int(share * 100)] = np.nan
    with pytest.raises(DiffractionError, match=word):
        fill_missing(heights, method, "patch")


def test_a_start_that_is_the_solution_is_left_as_it_is():
    heights = np.ones((2, 4))
    heights[1, 2:] = np.nan
    filled, _ = fill_missing(heights, "harmonic", "two gaps")
    assert np.array_equal(filled, np.ones((2, 4)))


@pytest.mark.parametrize("method", FILLS)
def test_infinite_heights_are_gaps_as_others(method):
    heights = np.ones((2, 5))
    heights[0, 2:] = np.nan, np.inf, -np.inf
    with pytest.raises(DiffractionError, match=r"3 of 10 .* fill=nearest"):
        fill_missing(heights, None, "patch")
    assert np.array_equal(fill_missing(heights, method, "patch")[0], np.ones((2, 5)))
