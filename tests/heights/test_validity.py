"""Damage of scans, tilt and jumping lines are named with what to do; gratings have none."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.validity import damage, jumping_lines, stands_in_full, tilted
from tests.support.directions import rough_patch

SHORTEST = 0.36
Y, X = np.mgrid[0:128, 0:128]
# Two incommensurate waves: no edge meets the opposite one.
SCALE = 0.06 * np.cos(0.17 * X + 0.05 * Y) + 0.03 * np.cos(0.11 * Y + 0.07 * X + 1)


def cut_out(heights, pixel_size=0.05):
    return HeightField(heights, pixel_size, name="scan", cut_out=True)


def test_a_ramp_is_found_and_said_with_its_rise():
    lines = cut_out(SCALE + 0.01 * X).validity()
    (tilt,) = [line for line in lines if "not levelled" in line]
    # 0.01 µm a pixel over 128, and the chance slope of the waves
    assert float(tilt.split("rises ")[1].split()[0]) == pytest.approx(1.28, abs=0.05)
    assert "level=plane: " in tilt
    level = cut_out(SCALE + 0.01 * X).treated(level="plane")
    assert not any("not levelled" in line for line in level.validity())


def test_a_tilt_below_a_quarter_wave_is_left_alone():
    smooth = rough_patch((64, 64), (0.05, 0.05), 0.02).heights
    for share, said in ((0.9, False), (1.3, True)):
        tilt = share * SHORTEST / 8 * np.arange(64) / 63
        assert tilted(cut_out(0.1 * smooth + tilt), SHORTEST) is said, share


@pytest.mark.parametrize("slope", [0.004, 0.012, 0.04, 0.1])
def test_a_smooth_tilted_scan_is_levelled_or_said_to_be_taken_for_a_facet(slope):
    smooth = rough_patch((64, 64), (0.3, 0.3), 0.0005).heights
    scan = cut_out(smooth + slope * 0.3 * np.arange(64), 0.3)
    # as steep as a blazed grating's facet, which a plane alone describes, too
    steep = slope > 0.05
    assert tilted(scan, SHORTEST) is not steep
    assert any("level=plane" in line and stands_in_full(line) for line in scan.validity()) is steep
    assert not any("level=plane" in line for line in scan.treated(level="plane").validity())


@pytest.mark.parametrize("periods", [1, 2, 3, 7])
@pytest.mark.parametrize("kind", [gratings.blazed, gratings.sinusoidal, gratings.lamellar])
@pytest.mark.parametrize("levels", [None, 255])
def test_whole_periods_of_a_grating_are_let_be(kind, periods, levels):
    heights = kind(period=2.5, depth=0.6, periods=periods, pixels_per_period=40).heights
    if levels:  # as an 8-bit image holds it
        heights = np.rint(heights * levels / heights.max()) * heights.max() / levels
    assert not tilted(cut_out(heights, 2.5 / 40), SHORTEST)
    assert not tilted(cut_out(heights.T, 2.5 / 40), SHORTEST)


@pytest.mark.parametrize("periods", [3, 4, 5])
def test_few_periods_of_a_sine_keep_their_height_when_loaded(tmp_path, periods):
    """The least-squares plane of a sine that begins at 0 rises by up to 0.6 of its amplitude."""
    x = 0.05 * np.arange(16 * periods)
    np.save(tmp_path / "sine.npy", np.tile(0.15 * np.sin(2.0 * np.pi * x / 0.8), (40, 1)))
    loaded = HeightField.load(tmp_path / "sine.npy", pixel_size=0.05)
    assert loaded.rms_height == pytest.approx(0.15 / np.sqrt(2.0), rel=1e-9)  # rounding


MADE = {
    "rough": lambda: rough_patch((64, 64), (0.05, 0.05), 0.1),
    "noise": lambda: HeightField(np.random.default_rng(1).normal(size=(64, 48)), 0.05),
    "flat": lambda: HeightField(np.full((8, 8), 0.3), 0.05),
    "few pixels": lambda: HeightField(np.random.default_rng(1).normal(size=(4, 6)), 0.05),
}


@pytest.mark.parametrize("name", MADE)
def test_level_surfaces_are_let_be(name):
    made = MADE[name]()
    assert not tilted(made, SHORTEST)  # even if they were taken for a scan


def test_files_are_levelled_by_default_and_left_alone_where_no_tilt_shows(tmp_path):
    def loaded(heights, **options):
        np.save(tmp_path / "a.npy", heights)
        return HeightField.load(tmp_path / "a.npy", pixel_size=0.05, **options)

    tilted = SCALE + 0.01 * X
    mended = loaded(tilted)
    assert mended.cut_out
    assert [line.split()[0] for line in mended.history] == ["plane"]
    np.testing.assert_array_equal(mended.heights, loaded(tilted, level="plane").heights)
    np.testing.assert_array_equal(loaded(tilted, level="none").heights, tilted)
    exact = loaded(tilted, periodic="exact")
    np.testing.assert_array_equal(exact.heights, tilted)
    assert exact.periodic
    assert not exact.cut_out
    for name in ("rough", "noise", "flat"):
        np.testing.assert_array_equal(loaded(MADE[name]().heights).heights, MADE[name]().heights)
    teeth = gratings.blazed(2.5, 0.3, periods=2, pixels_per_period=40).heights
    np.testing.assert_array_equal(loaded(teeth).heights, teeth)


def test_lines_that_jump_are_suggested_to_be_levelled():
    rough = rough_patch((128, 128), (0.05, 0.05), 0.02).heights
    jumping = cut_out(rough + 0.02 * np.random.default_rng(1).normal(size=(128, 1)))
    assert "level=lines" in jumping_lines(jumping)
    for still in (cut_out(rough), cut_out(rough.T), jumping.treated(level="lines")):
        assert jumping_lines(still) == ""


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (3, 2)])
def test_few_lines_are_described_without_a_warning_of_numpy(shape):
    patch = cut_out(0.01 * np.random.default_rng(1).normal(size=shape))
    assert jumping_lines(patch) == ""
    assert isinstance(patch.validity(), list)


NORMAL = gaussian_filter(np.random.default_rng(1).normal(0.0, 0.03, (128, 128)), 3, mode="wrap")
ROUGH = rough_patch((128, 128), (0.05, 0.05), 0.02).heights


@pytest.mark.parametrize("level", ["none", "plane"])
@pytest.mark.parametrize(
    ("rows", "named"), [(slice(90, None), "last 38"), (slice(0, 30), "first 30")]
)
def test_an_aborted_scan_is_named_with_what_is_left(rows, named, level):
    aborted = ROUGH.copy()
    aborted[rows] = 0.0
    (line,) = damage(cut_out(aborted).treated(level=level))
    assert named in line
    crop = re.search(r"use crop=([\d.,]+):", line)[1]
    assert damage(cut_out(aborted).treated(level=level, crop=crop)) == []


def test_rows_that_filled_a_rim_are_not_a_stuck_scanner(tmp_path):
    rim = ROUGH.copy()
    rim[:6] = rim[-6:] = np.nan
    np.save(tmp_path / "rim.npy", rim)
    field = HeightField.load(tmp_path / "rim.npy", pixel_size=0.05, fill="nearest")
    assert not any("stuck" in line for line in damage(field))


def test_repeated_rows_are_counted():
    stuck = ROUGH.copy()
    stuck[60:66] = stuck[59]
    (line,) = damage(cut_out(stuck))
    assert "6 of 128 rows repeat" in line


def test_a_bow_is_named_and_removed():
    y, x = np.mgrid[-1:1:128j, -1:1:128j]
    bent = cut_out(ROUGH + 0.1 * x**2 + 0.05 * y * x - 0.07 * x)
    (line,) = damage(bent)
    assert "level=quadratic" in line
    even = bent.treated(level="quadratic")
    assert damage(even) == []
    # lines that are aligned keep the bow along them; the option would replace their alignment
    (beside,) = damage(bent.treated(level="lines"))
    assert "treated(level='quadratic')" in beside
    assert damage(bent.treated(level="lines").treated(level="quadratic")) == []
    # a paraboloid takes 6 of the some hundred independent heights of the rough waves
    left = even.heights - even.heights.mean() - (ROUGH - ROUGH.mean())
    assert left.std() < 0.3 * ROUGH.std()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_dust_is_named_and_clipped(sign):
    dusty = NORMAL.copy()
    for x, y in ((20, 31), (77, 80), (101, 12)):
        dusty[y : y + 4, x : x + 4] = sign * 0.15
    (line,) = damage(cut_out(dusty))
    assert "clip=5" in line
    assert damage(cut_out(dusty).treated(clip=5.0)) == []


@pytest.mark.parametrize("turned", [False, True])
def test_sound_scans_and_gratings_have_no_damage(turned):
    made = (gratings.lamellar(2.5, 0.3, periods=4, rows=64), gratings.sinusoidal(1.6, 0.1, rows=64))
    for heights in (ROUGH, NORMAL, *(one.heights for one in made), np.zeros((32, 32))):
        assert damage(cut_out(heights.T if turned else heights)) == []
