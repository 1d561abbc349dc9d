"""Levelling takes out what was put in, and says so."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.preprocess import clip_outliers, level_lines, level_plane, plane_of

RNG = np.random.default_rng(11)


def number_after(word, line):
    return float(line.split(f"{word} ")[1].split()[0])


ROUGH = 0.02 * RNG.standard_normal((60, 80))
Y, X = np.mgrid[0:60, 0:80]


def test_plane_is_found_and_removed():
    tilted = HeightField(0.01 * 0.5 * X - 0.02 * 0.25 * Y + 3, (0.5, 0.25), history=["old"])
    assert plane_of(tilted) == pytest.approx((0.01, -0.02), rel=1e-10)  # rounding
    level = level_plane(tilted)
    assert level.range < 1e-12  # rounding of heights of 3 µm
    assert level.heights.mean() == pytest.approx(tilted.heights.mean(), rel=1e-12)
    old, line = level.history
    assert old == "old"
    assert line.startswith("plane removed: it rose 0.4 µm along x and -0.3 µm along y")
    # three digits are printed
    assert number_after("RMS change", line) == pytest.approx(tilted.rms_height, rel=5e-3)


def test_levelling_twice_changes_nothing_more():
    once = level_plane(HeightField(ROUGH + 0.003 * X, 0.1))
    assert level_plane(once).heights == pytest.approx(once.heights, abs=1e-12)  # rounding


def test_scan_lines_are_aligned():
    offsets = RNG.normal(size=(60, 1))
    field = HeightField(ROUGH + offsets + 0.001 * X, 0.1)
    level = level_lines(field)
    # a row's median of 80 samples of 0.02 µm is off by 1.25 · 0.02/√80 = 0.003 µm
    assert level.rms_height == pytest.approx(0.02, rel=0.05)
    assert number_after("scattered by", level.history[0]) == pytest.approx(offsets.std(), rel=0.02)
    assert np.ptp(np.median(level.heights, axis=1)) < 0.02


def test_dust_is_clipped_and_counted():
    dusty = ROUGH.copy()
    dusty[10:13, 20:22] = 1.5
    clean = clip_outliers(HeightField(dusty, 0.1), 5)
    (line,) = clean.history
    assert line.startswith("6 of 4800 points clipped")
    assert clean.heights.max() == pytest.approx(5 * 0.02, rel=0.1)  # 4800 samples estimate σ
    untouched = dusty < 1
    assert np.array_equal(clean.heights[untouched], dusty[untouched])
    assert number_after("the furthest by", line) == pytest.approx(1.4, rel=0.02)


def test_nothing_to_clip_changes_nothing_and_says_so():
    for heights in (np.zeros((4, 4)), ROUGH):
        same = clip_outliers(HeightField(heights, 0.1), 8)
        assert np.array_equal(same.heights, heights)
        assert same.history[0].startswith("no point is clipped: all are within 8 robust")


@pytest.mark.parametrize("sigmas", [0, -1, 0.5, float("nan"), float("inf")])
def test_clip_needs_a_sensible_width(sigmas):
    with pytest.raises(DiffractionError, match="clip"):
        HeightField(ROUGH, 0.1).treated(clip=sigmas)


def test_clip_refuses_heights_without_a_deviation():
    steps = np.zeros((10, 10))
    steps[0] = 1
    with pytest.raises(DiffractionError, match="more than half"):
        clip_outliers(HeightField(steps, 0.1), 3)


def test_a_patch_in_memory_is_treated_as_a_file_is(tmp_path):
    heights = ROUGH + 0.003 * X + RNG.normal(size=(60, 1))
    np.save(tmp_path / "scan.npy", heights)
    asked = {"level": "lines", "clip": 4, "periodic": "exact"}
    loaded = HeightField.load(tmp_path / "scan.npy", pixel_size=0.1, **asked)
    treated = HeightField(heights, 0.1).treated(**asked)
    assert np.array_equal(treated.heights, loaded.heights)
    assert treated.history == loaded.history
    assert len(treated.history) == 3


def test_no_treatment_changes_nothing():
    field = HeightField(ROUGH, 0.1)
    assert np.array_equal(field.treated().heights, field.heights)
    with pytest.raises(DiffractionError, match="level: expected one of 'auto', 'none', 'plane'"):
        field.treated(level="bow")
