"""Treatments that change a scan as much as they keep, lines that jump, slopes that light sees."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.heights.read import LoadOptions
from mitsuba_diffraction.heights.source import Source
from mitsuba_diffraction.heights.spectra import examine_periods, seen_slope
from mitsuba_diffraction.heights.treatment import jumping_lines, treatment_warning
from tests.support.directions import rough_patch

OPTIONS = LoadOptions.parse(pixel_size=0.05)


def loaded(heights, path, **options):
    np.save(path, heights)
    how = OPTIONS.updated(LoadOptions.parse(**options))
    return how, Source.of(path, how).field()


def test_a_bowl_that_is_made_periodic_is_warned_of(tmp_path):
    x = np.linspace(-1.0, 1.0, 128)
    bowl = 0.2 * x**3 - 0.2 * x[:, None] ** 3 * (1.0 + x)
    path = tmp_path / "bowl.npy"
    for periodic, warned in (("smooth", True), ("none", False)):
        how, field = loaded(bowl, path, periodic=periodic, level="none")
        assert bool(treatment_warning(path, how, field)) == warned
    rough = rough_patch((128, 128), (0.05, 0.05), 0.05).heights
    how, field = loaded(rough, path, periodic="smooth")
    assert treatment_warning(path, how, field) == ""


def test_lines_that_jump_are_suggested_to_be_levelled(tmp_path):
    rough = rough_patch((128, 128), (0.05, 0.05), 0.02).heights
    rng = np.random.default_rng(1)
    path = tmp_path / "lines.npy"
    _, field = loaded(rough + 0.02 * rng.normal(size=(128, 1)), path)
    assert "level=lines" in jumping_lines(field)
    for still in (loaded(rough, path)[1], loaded(rough.T, path)[1]):
        assert jumping_lines(still) == ""
    _, level = loaded(rough + 0.02 * rng.normal(size=(128, 1)), path, level="lines")
    assert jumping_lines(level) == ""


def test_noise_of_pixels_adds_nothing_to_the_slope_that_light_sees():
    smooth = md.gratings.sinusoidal(period=1.6, depth=0.06, periods=8, rows=64)
    noise = 0.002 * np.random.default_rng(2).normal(size=smooth.heights.shape)
    noisy = md.HeightField(smooth.heights + noise, smooth.pixel_size, periodic=True)
    assert noisy.rms_slope > 1.3 * smooth.rms_slope
    # of white noise the part below 2/λ remains, a tenth of the frequencies here
    assert seen_slope(noisy, 0.36) == pytest.approx(smooth.rms_slope, rel=0.1)
    assert seen_slope(smooth, 0.36) == pytest.approx(smooth.rms_slope, rel=0.01)


@pytest.mark.parametrize(("periods", "certain"), [(3, False), (8, True)])
def test_periods_with_few_repeats_are_perhaps_one(periods, certain):
    x = np.arange(256) * (1.6 * periods / 256)
    heights = np.tile(0.03 * np.sin(2.0 * np.pi * x / 1.6), (256, 1))
    field = md.HeightField(heights, float(x[1]), cut_out=True)
    (grating, *_), _ = examine_periods(field)
    assert grating.repeats == pytest.approx(periods, rel=0.1)
    assert str(grating).startswith("perhaps") != certain
    assert "repeats" in str(grating)
