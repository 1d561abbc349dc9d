"""The middle of a patch, and nothing else of it."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.preprocess import crop

HEIGHTS = np.arange(48.0).reshape(6, 8) * 0.001
FIELD = HeightField(HEIGHTS, (0.5, 0.25), name="scan", history=["old"])


def test_the_middle_is_kept_and_said():
    middle = crop(FIELD, (2.0, 1.0))
    assert np.array_equal(middle.heights, HEIGHTS[1:5, 2:6])
    assert middle.extent == (2.0, 1.0)
    assert middle.cut_out
    line = "cropped to the middle 2 x 1 µm of 4 x 1.5 µm (4 x 4 of 8 x 6 pixels)"
    assert middle.history == ("old", line)


def test_all_of_a_patch_is_the_patch():
    assert crop(FIELD, (4.0, 1.5)) is FIELD


@pytest.mark.parametrize(
    ("size", "words"),
    [((5, 1), "larger than the patch"), ((1, 2), "larger"), ((0.5, 1), "less than two pixels")],
)
def test_what_is_not_there_is_refused_in_one_line(size, words):
    with pytest.raises(DiffractionError, match=words) as caught:
        crop(FIELD, size)
    assert "the patch is 4 x 1.5 µm" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", ["1", 1.0, "1, 1", (1, 1), [1.0, 1.0]])
def test_files_recipes_and_memory_are_cropped_alike(tmp_path, given):
    np.save(tmp_path / "a.npy", HEIGHTS)
    loaded = HeightField.load(tmp_path / "a.npy", pixel_size=(0.5, 0.25), crop=given)
    assert np.array_equal(loaded.heights, HEIGHTS[1:5, 3:5])
    assert "cropped" in loaded.history[0]
    assert FIELD.treated(crop=given).digest() == loaded.digest()
    recipe = tmp_path / "a.toml"
    recipe.write_text('source = "a.npy"\npixel_size = [0.5, 0.25]\ncrop = 1.0\n')
    assert HeightField.load(recipe).digest() == loaded.digest()


def test_gaps_outside_the_middle_do_not_matter_and_tilt_is_that_of_the_middle(tmp_path):
    heights = HEIGHTS.copy()
    heights[0, 0] = np.nan
    np.save(tmp_path / "a.npy", heights)
    asked = {"pixel_size": (0.5, 0.25), "crop": "2,1"}
    assert HeightField.load(tmp_path / "a.npy", **asked).history[0].startswith("cropped")
    level = HeightField.load(tmp_path / "a.npy", **asked, level="plane")
    assert level.range < 1e-15  # HEIGHTS is a plane: rounding
    assert [line.split()[0] for line in level.history] == ["cropped", "plane"]


@pytest.mark.parametrize("bad", [0, -1, "wide", (1, 2, 3), float("nan"), True, ""])
def test_no_size_is_named(bad):
    with pytest.raises(DiffractionError, match="crop: expected a width or a pair"):
        FIELD.treated(crop=bad)


def test_a_region_elsewhere_has_its_lower_left_corner(tmp_path):
    part = FIELD.treated(crop="2, 1, 0.5, 0.25", level="none")
    np.testing.assert_array_equal(part.heights, FIELD.heights[1:5, 1:5])
    assert "from 1, 1" in part.history[-1]
    with pytest.raises(DiffractionError, match="leaves the patch"):
        FIELD.treated(crop=(2.0, 1.0, 2.5, 0.0))
    recipe = tmp_path / "a.toml"
    np.save(tmp_path / "a.npy", FIELD.heights)
    recipe.write_text('source = "a.npy"\npixel_size = [0.5, 0.25]\ncrop = [2, 1, 0.5, 0.25]\n')
    assert HeightField.load(recipe).digest() == part.digest()
