"""Treatments: the middle of a patch, levelling and clipping, and points without data."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.preprocess import (
    FILLS,
    clip_outliers,
    crop,
    fill_missing,
    level_lines,
    level_plane,
    plane_of,
)

GRID = np.arange(48.0).reshape(6, 8) * 0.001
FIELD = HeightField(GRID, (0.5, 0.25), name="scan", history=["old"])


def test_the_middle_is_kept_and_said():
    middle = crop(FIELD, (2.0, 1.0))
    assert np.array_equal(middle.heights, GRID[1:5, 2:6])
    assert middle.extent == (2.0, 1.0)
    assert middle.cut_out
    line = "cropped to the middle 2 x 1 µm of 4 x 1.5 µm (4 x 4 of 8 x 6 pixels)"
    assert middle.history == ("old", line)


def test_all_of_a_patch_is_the_patch():
    assert crop(FIELD, (4.0, 1.5)) is FIELD


@pytest.mark.parametrize(
    ("size", "words"),
    [
        ((5, 1), "larger than the patch"), ((1, 2), "larger"), ((0.5, 1), "less than two pixels"),
        ((2.0, 1.0, 2.5, 0.0), "leaves the patch"),
    ],
)  # fmt: skip
def test_a_crop_that_is_not_there_is_refused_in_one_line(size, words):
    with pytest.raises(DiffractionError, match=words) as caught:
        crop(FIELD, size)
    assert "is 4 x 1.5 µm" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("given", "part", "note"),
    [
        *((one, np.s_[1:5, 3:5], "the middle") for one in ("1", 1.0, "1, 1", (1, 1), [1.0, 1.0])),
        # a region elsewhere has its lower left corner
        *((one, np.s_[1:5, 1:5], "from 1, 1") for one in ("2, 1, 0.5, 0.25", [2, 1, 0.5, 0.25])),
    ],
)
def test_files_recipes_and_memory_are_cropped_alike(tmp_path, given, part, note):
    np.save(tmp_path / "a.npy", GRID)
    loaded = HeightField.load(tmp_path / "a.npy", pixel_size=(0.5, 0.25), crop=given)
    assert np.array_equal(loaded.heights, GRID[part])
    assert "cropped" in loaded.history[0]
    assert note in loaded.history[0]
    assert FIELD.treated(crop=given).digest() == loaded.digest()
    recipe = tmp_path / "a.toml"
    crop = json.dumps(given)
    recipe.write_text(f'source = "a.npy"\npixel_size = [0.5, 0.25]\ncrop = {crop}\n')
    assert HeightField.load(recipe).digest() == loaded.digest()


def test_gaps_outside_the_middle_do_not_matter_and_tilt_is_that_of_the_middle(tmp_path):
    heights = GRID.copy()
    heights[0, 0] = np.nan
    np.save(tmp_path / "a.npy", heights)
    asked = {"pixel_size": (0.5, 0.25), "crop": "2,1"}
    assert HeightField.load(tmp_path / "a.npy", **asked).history[0].startswith("cropped")
    level = HeightField.load(tmp_path / "a.npy", **asked, level="plane")
    assert level.range < 1e-15  # GRID is a plane: rounding
    assert [line.split()[0] for line in level.history] == ["cropped", "plane"]


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *(("crop", bad) for bad in (0, -1, "wide", (1, 2, 3), float("nan"), True, "")),
        *(("clip", bad) for bad in (0, -1, 0.5, float("nan"), float("inf"))),
        ("level", "bow"),
    ],
)
def test_a_treatment_of_no_sense_is_named(option, value):
    with pytest.raises(DiffractionError, match=option):
        FIELD.treated(**{option: value})


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


def test_clip_refuses_heights_without_a_deviation():
    steps = np.zeros((10, 10))
    steps[0] = 1
    with pytest.raises(DiffractionError, match="more than half"):
        clip_outliers(HeightField(steps, 0.1), 3)


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


@pytest.mark.parametrize(("side", "radius"), [(50, 8), (200, 76)])
def test_harmonic_continues_a_plane_through_inner_gaps(side, radius):
    """Of up to 45 % of the patch."""
    y, x = np.mgrid[0 : side - 10, 0:side] / side
    plane = 5 * x - 2 * y + 3
    holed = np.where(np.hypot(y - 0.4, x - 0.5) * side < radius, np.nan, plane)
    filled, _ = fill_missing(holed, "harmonic", "patch")
    # a plane is harmonic; conjugate gradients stop at 1e-9 of the heights' norm, 1e3
    assert filled == pytest.approx(plane, abs=1e-5)


@pytest.mark.parametrize(
    ("share", "method", "word"),
    [(0.1, None, "fill"), (0.7, "harmonic", "too many"), (1, "nearest", "empty")],
)
def test_what_cannot_be_filled_is_refused(share, method, word):
    heights = np.ones((10, 10))
    heights.ravel()[: int(share * 100)] = np.nan
    with pytest.raises(DiffractionError, match=word):
        fill_missing(heights, method, "patch")


@pytest.mark.parametrize("method", FILLS)
def test_infinite_heights_are_gaps_as_others(method):
    heights = np.ones((2, 5))
    heights[0, 2:] = np.nan, np.inf, -np.inf
    with pytest.raises(DiffractionError, match=r"3 of 10 .* fill=nearest"):
        fill_missing(heights, None, "patch")
    assert np.array_equal(fill_missing(heights, method, "patch")[0], np.ones((2, 5)))
