"""The taps of a look-up: the nearest bins, their Gaussian weights, and what they leave out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import erf

from mitsuba_diffraction.tables.window import (
    base_bin,
    first_tap,
    missing_power,
    reach_error,
    tap_matrix,
    taps_for,
    trims_for,
)


@given(st.floats(-1e4, 1e4), st.integers(1, 64))
def test_taps_are_the_nearest_bins(position, taps):
    x = np.array([position])
    bins = base_bin(x, taps)[0] + first_tap(taps) + np.arange(taps)
    # none of those left out is nearer than the farthest of those taken
    left_out = np.array([bins[0] - 1, bins[-1] + 1])
    assert np.abs(left_out - position).min() >= np.abs(bins - position).max()
    assert np.abs(bins - position).max() <= 0.5 * taps


def test_all_of_the_window_is_a_dense_gaussian():
    positions = np.random.default_rng(1).uniform(-9.0, 9.0, 40)
    bins = np.arange(-12, 20)
    dense = np.exp(-0.6 * (positions[:, None] - bins) ** 2)
    sparse = tap_matrix(positions, -12, 32, 0.6, None).toarray()
    assert np.abs(sparse - dense).max() < 1e-9  # exp(−4.6²) is left out


def test_taps_beyond_the_bins_are_left_out():
    matrix = tap_matrix(np.array([-2.3, 2.3]), -2, 5, 0.5, 4).toarray()
    assert matrix.shape == (2, 5)
    assert np.count_nonzero(matrix[0]) == np.count_nonzero(matrix[1]) == 2


@pytest.mark.parametrize("step", [0.2, 0.8, 1.6])
@pytest.mark.parametrize("taps", [1, 2, 3, 4, 7])
def test_the_missing_power_is_what_the_taps_leave_on_average(step, taps):
    positions = np.linspace(0.0, 1.0, 400, endpoint=False)  # evenly between the bins
    few = tap_matrix(positions, -100, 201, step**2, taps).sum(axis=1)
    all_ = tap_matrix(positions, -100, 201, step**2, None).sum(axis=1)
    missing = 1.0 - few.sum() / all_.sum()
    # 400 points resolve the jump from one set of taps to the next to 1/400 of it
    assert missing == pytest.approx(missing_power(step, taps), rel=0.02, abs=1e-8)


@given(st.tuples(st.floats(0.05, 3.0), st.floats(0.05, 3.0)), st.floats(1e-6, 0.5), st.booleans())
def test_the_fewest_taps_meet_their_error(steps, error, coherent):
    taps = taps_for(steps, error, coherent)
    # half of it a direction is sufficient where powers are added, a little more than needed else
    assert reach_error(steps, taps, coherent) <= error * (1 + 1e-9)
    fewer = tuple(max(1, n - 1) for n in taps)
    if fewer[0] < taps[0] and fewer[1] < taps[1]:
        assert reach_error(steps, fewer, coherent) > error


def test_a_usual_look_up_reads_four_taps_and_a_coherent_one_five():
    # patch as wide as the window: σ·dq = 2π/4; design section 3
    step = 2 * np.pi / 4
    assert taps_for((step, step), 5e-4, coherent=False) == (4, 4)
    assert taps_for((step, step), 5e-4, coherent=True) == (5, 5)


@pytest.mark.parametrize(("error", "trimmed"), [(0.012, False), (0.02, True)])
def test_corners_left_out_and_all_beyond_the_taps_meet_the_error_together(error, trimmed):
    trims = trims_for((0.8, 0.8), (5, 5), error, coherent=False)
    assert bool(trims) == trimmed
    share = 0.5 * np.diff(erf(0.8 * (np.arange(6) - 2.5)))  # of a tap, the mean over positions
    rows = [share[trim : 5 - trim].sum() for trim in trims or [0] * 5]
    assert share @ rows >= 1.0 - error
