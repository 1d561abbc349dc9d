"""Patches that fit themselves."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.preprocess import (
    periodic_smooth,
    periodic_taper,
    periodic_trend,
)
from mitsuba_diffraction.heights.seams import seam_share, seam_step

Y, X = np.mgrid[0:48, 0:64]
WAVES = 0.1 * np.cos(2 * np.pi * (3 * X / 64 + 2 * Y / 48))
RAMP = 0.01 * X - 0.004 * Y


@pytest.mark.parametrize("pixel_size", [0.1, (0.1, 0.2)])
def test_periodic_part_plus_smooth_part_is_the_patch(pixel_size):
    """Moisan's defining property: the smooth part's Laplacian is the seams' steps, nothing else."""
    field = HeightField(RAMP + 0.1 * np.random.default_rng(0).random(X.shape), pixel_size)
    periodic = periodic_smooth(field)
    smooth = field.heights - periodic.heights
    (dx, dy), h = field.pixel_size, field.heights
    laplacian = (np.roll(smooth, 1, 1) + np.roll(smooth, -1, 1) - 2 * smooth) / dx**2
    laplacian += (np.roll(smooth, 1, 0) + np.roll(smooth, -1, 0) - 2 * smooth) / dy**2
    seams = np.zeros_like(h)
    seams[:, 0] += (h[:, -1] - h[:, 0]) / dx**2
    seams[:, -1] -= (h[:, -1] - h[:, 0]) / dx**2
    seams[0] += (h[-1] - h[0]) / dy**2
    seams[-1] -= (h[-1] - h[0]) / dy**2
    assert laplacian == pytest.approx(seams, abs=1e-9)  # rounding of values near 60
    assert smooth.mean() == pytest.approx(0, abs=1e-12)


def test_periodic_heights_keep_their_waves_and_lose_their_ramp():
    field = HeightField(WAVES + RAMP, 0.1)
    periodic = periodic_smooth(field)
    assert seam_step(periodic) < 0.1 * seam_step(field)
    # what is left of the ramp is one ordinary step at the seams: 0.01 µm in x, 0.004 in y
    assert periodic.heights == pytest.approx(WAVES + RAMP.mean(), abs=0.03)
    # white slopes would have 1/64 to 1/48 at the seams
    assert seam_share(periodic) < 0.05 < 0.5 < seam_share(field)
    (line,) = periodic.history
    assert " of the mean-square slope; RMS change " in line


def test_trend_loses_waves_longer_than_the_patch_and_keeps_ridges():
    ridges = HeightField(0.1 * np.sin(0.75 * X), 0.1)  # 7.6 periods
    change = (periodic_trend(ridges).heights - ridges.heights).std()
    # of white noise a cubic in 64 columns has 4/64 of the mean square
    assert change < 0.25 * ridges.rms_height
    assert change < 0.6 * (periodic_smooth(ridges).heights - ridges.heights).std()
    long = HeightField(1e-5 * (X - 32.0) ** 3 + RAMP, 0.1)
    assert seam_step(periodic_trend(long)) < 0.1 * seam_step(long)
    smallest = HeightField(np.array([[0.0, 0.1], [0.2, 0.5]]), 0.1)
    assert np.isfinite(periodic_trend(smallest).heights).all()


def test_taper_meets_at_the_mean_and_keeps_the_middle():
    field = HeightField(WAVES + RAMP, 0.1)
    tapered = periodic_taper(field)
    assert tapered.heights[10:38, 10:54] == pytest.approx(field.heights[10:38, 10:54], abs=1e-12)
    # half a sample from the border the window is sin²(π/2 · 0.5/4.8) = 0.027 at most
    border = np.concatenate([tapered.heights[0], tapered.heights[:, -1]])
    assert np.abs(border - field.heights.mean()).max() < 0.03 * field.range
    assert seam_step(tapered) < 0.05 * seam_step(field)


def test_flat_patches_stay_flat():
    flat = HeightField(np.full((4, 6), 0.2), 0.1)
    for treat in (periodic_smooth, periodic_taper, periodic_trend):
        assert treat(flat).heights == pytest.approx(0.2, abs=1e-15)
