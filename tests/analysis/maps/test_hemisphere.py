"""Pixels of the hemisphere, and the samples in them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.analysis.maps import hemisphere


def test_the_hemisphere_s_pixels_are_those_that_it_touches():
    n = 40
    x = (np.arange(n * 50) + 0.5) / (n * 25) - 1  # 50² points in each pixel
    fine = (x[:, None] ** 2 + x**2 < 1).reshape(n, 50, n, 50).any(axis=(1, 3))
    inside = hemisphere.inside(n)
    assert np.all(inside | ~fine)
    assert (inside & ~fine).sum() <= 8  # touched by less than the points can tell


@given(st.integers(1, 200))
def test_sub_samples_take_every_place_once_in_each_direction(samples):
    pattern = hemisphere.sub_samples(samples)
    places = (np.arange(samples) + 0.5) / samples
    for column in pattern.T:
        np.testing.assert_array_equal(np.sort(column), places)
    assert len(np.unique(pattern[:, :2], axis=0)) == samples
