"""Patches that fit themselves."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.preprocess.periodic import (
    cross_share,
    periodic_smooth,
    periodic_taper,
    seam_step,
)

Y, X = np.mgrid[0:48, 0:64]
WAVES = 0.1 * np.cos(2 * np.pi * (3 * X / 64 + 2 * Y / 48))
RAMP = 0.01 * X - 0.004 * Y


@pytest.mark.parametrize("pixel_size", [0.1, (0.1, 0.2)])
def test_periodic_part_plus_smooth_part_is_the_patch(pixel_size):
    """Moisan's defining property: the smooth part's Laplacian is the seams' steps, nothing else."""
    field = HeightField(RAMP + 0.1 * np.random.default_rng(0).random(X.shape), pixel_size)
    periodic, _ = periodic_smooth(field)
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
    periodic, change = periodic_smooth(field)
    assert seam_step(periodic) < 0.1 * seam_step(field)
    # what is left of the ramp is one ordinary step at the seams: 0.01 µm in x, 0.004 in y
    assert periodic.heights == pytest.approx(WAVES + RAMP.mean(), abs=0.03)
    assert change.figures["cross_after"] < 0.2 * change.figures["cross_before"]
    assert periodic.history == (change.line,)
    # white slopes would have 1/64 to 1/48 at the seams
    assert change.figures["share_after"] < 0.05 < 0.5 < change.figures["share_before"]
    assert change.line.split(";")[0].endswith(" of the mean-square slope")


def test_taper_meets_at_the_mean_and_keeps_the_middle():
    field = HeightField(WAVES + RAMP, 0.1)
    tapered, _ = periodic_taper(field)
    assert tapered.heights[10:38, 10:54] == pytest.approx(field.heights[10:38, 10:54], abs=1e-12)
    # half a sample from the border the window is sin²(π/2 · 0.5/4.8) = 0.027 at most
    border = np.concatenate([tapered.heights[0], tapered.heights[:, -1]])
    assert np.abs(border - field.heights.mean()).max() < 0.03 * field.range
    assert seam_step(tapered) < 0.05 * seam_step(field)


def test_white_noise_has_an_even_share_in_the_cross():
    field = HeightField(np.random.default_rng(2).random((64, 96)), 0.1)
    # slope power is higher off the axes of the discrete spectrum: half the count, ± its scatter
    assert cross_share(field) == pytest.approx(0.5 * (3 / 64 + 3 / 96), rel=0.15)


def test_a_step_that_varies_along_the_seam_counts_though_its_mean_is_none():
    # as a scan has it whose lines were levelled: rows rise by as much here as they fall there
    y, x = np.mgrid[0:64, 0:96]
    twisted = 0.5 * (x / 96 - 0.5) * np.cos(2 * np.pi * y / 64)
    noise = 0.004 * np.random.default_rng(5).random((64, 96))
    assert cross_share(HeightField(twisted + noise, 0.1)) > 0.9
    assert cross_share(HeightField(noise, 0.1)) < 0.1


@pytest.mark.parametrize("shape", [(8, 8), (9, 8), (8, 9), (9, 9), (2, 2), (2, 3)])
def test_cross_share_counts_the_whole_spectrum(shape):
    heights = np.random.default_rng(4).random(shape)
    field = HeightField(heights, (0.1, 0.3))
    power = np.abs(np.fft.fft2(heights)) ** 2
    along_y = (2 - 2 * np.cos(2 * np.pi * np.fft.fftfreq(shape[0]))) / 0.3**2
    along_x = (2 - 2 * np.cos(2 * np.pi * np.fft.fftfreq(shape[1]))) / 0.1**2
    power *= along_y[:, None] + along_x
    # the axes, and the frequencies on both sides of them
    cross = np.zeros(shape, bool)
    cross[[0, 1, -1]] = cross[:, [0, 1, -1]] = True
    expected = power[cross].sum() / power.sum()
    assert cross_share(field) == pytest.approx(expected, rel=1e-10)  # rounding


def test_flat_patches_stay_flat():
    flat = HeightField(np.full((4, 6), 0.2), 0.1)
    for treat in (periodic_smooth, periodic_taper):
        treated, change = treat(flat)
        assert treated.heights == pytest.approx(0.2, abs=1e-15)
        assert change.figures["cross_after"] == 0
