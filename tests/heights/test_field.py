"""Properties of HeightField: what it accepts, what it computes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights import field as field_module
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.validity import tilted
from mitsuba_diffraction.limits import MOST_PIXELS
from tests.support.scans import PIXEL, rough

FLAT = np.zeros((3, 4))


def test_heights_are_copied_and_read_only():
    heights = np.zeros((3, 4), dtype=np.float32, order="F")
    field = HeightField(heights, 1)
    heights[0, 0] = 7
    assert field.heights[0, 0] == 0
    assert field.heights.dtype == np.float64
    assert field.heights.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        field.heights[0, 0] = 1


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (0.05, (0.05, 0.05)),
        ((0.05, 0.1), (0.05, 0.1)),
        ([1, 2], (1.0, 2.0)),
        (np.float32(0.5), (0.5, 0.5)),
        (np.array([0.25, 0.5]), (0.25, 0.5)),
        ("0.05", (0.05, 0.05)),
        ("0.05, 0.1", (0.05, 0.1)),
        (" 0.05 0.1 ", (0.05, 0.1)),
    ],
)
def test_pixel_size_takes_numbers_pairs_and_strings(given, expected):
    assert HeightField(FLAT, given).pixel_size == expected


def test_statistics_of_a_plane():
    y, x = np.mgrid[0:40, 0:30]
    field = HeightField(0.2 * x * 0.5 + 0.1 * y * 0.25, (0.5, 0.25))
    assert field.shape == (40, 30)
    assert field.extent == (15.0, 10.0)
    # exact differences of an exact plane: rounding only
    assert field.rms_slope == pytest.approx(math.hypot(0.2, 0.1), rel=1e-12)
    assert field.range == pytest.approx(0.2 * 0.5 * 29 + 0.1 * 0.25 * 39, rel=1e-12)
    assert field.rms_height == pytest.approx(field.heights.std(), rel=1e-12)


def test_equal_content_has_equal_digest():
    heights = np.random.default_rng(1).random((5, 6))
    field = HeightField(heights, 0.1)
    assert field.digest() == HeightField(heights.copy(order="F"), (0.1, 0.1), name="b").digest()
    assert field.digest() != HeightField(heights, 0.2).digest()
    assert field.digest() != HeightField(heights.reshape(6, 5), 0.1).digest()
    assert field.digest() != HeightField(heights + 1e-9, 0.1).digest()


def test_gentle_well_sampled_patch_is_valid():
    x = np.tile(np.arange(8), (8, 1))
    assert HeightField(0.002 * x, 0.05).validity((360, 830)) == []
    assert HeightField(FLAT, 0.05).validity() == []


@pytest.mark.parametrize(
    ("heights", "pixel", "word"),
    [
        (0.015 * np.arange(8), 0.05, "5 to 20 %"),
        (0.02 * np.arange(8), 0.05, "more than 20 %"),
        (0.002 * np.arange(8), 0.0901, "coarser than a quarter"),  # λ/4 = 0.09 µm
        (2e-9 * np.arange(8), 0.05, "metres"),
        (0.002 * np.arange(8), 48.8, "is the pixel size of 48.8 µm in nm?"),
        (4.0 * np.arange(8), 0.05, "are the heights, with a range of 28 µm"),
    ],
)
def test_each_cause_of_doubt_is_one_line(heights, pixel, word):
    lines = HeightField(np.tile(heights, (8, 1)), pixel).validity((360, 830))
    assert len(lines) == 1
    assert word in lines[0]
    assert "\n" not in lines[0]


@pytest.mark.parametrize(
    ("heights", "word"),
    [
        (np.full((4, 4), np.nan), "no height is a finite number"),
        (np.where(np.eye(4), np.nan, 0), "4 of 16 heights are NaN"),
        (np.where(np.eye(4), np.inf, 0), "4 infinite"),
        (np.zeros((1, 1)), "1 x 1"),
        (np.zeros((1, 9)), "9 x 1"),
        (np.zeros((0, 9)), "9 x 0"),
        (np.zeros(9), "two dimensions"),
        (np.zeros((2, 2, 2)), "two dimensions"),
        (np.zeros((4, 4), dtype=complex), "complex"),
        (np.zeros((4, 4), dtype=bool), "bool"),
        ("surface", "expected real numbers"),
        ([[1, 2], [3]], "not an array"),
        (np.diag([0, 0, 0, 1e9]), "in µm"),
        (np.ma.masked_less(np.arange(9.0).reshape(3, 3), 4), "masked"),
    ],
)
def test_unusable_heights_are_refused(heights, word):
    with pytest.raises(DiffractionError, match=word) as caught:
        HeightField(heights, 0.1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("flag", ["periodic", "cut_out"])
def test_words_for_flags_are_refused(flag):
    """`HeightField.load` takes words, of which "open" would be true here."""
    with pytest.raises(DiffractionError, match=f"{flag}='open' must be True or False"):
        HeightField(np.eye(4), 0.1, **{flag: "open"})


def test_absurd_sizes_are_refused_without_memory():
    huge = np.broadcast_to(np.zeros(1), (2**20, 2**20))
    with pytest.raises(DiffractionError, match=str(MOST_PIXELS)):
        HeightField(huge, 0.1)


@pytest.mark.parametrize(
    "pixel_size",
    [0, -1, math.nan, math.inf, (0.1, 0), (0.1, 0.1, 0.1), (), "", "wide", "0.1,nan", "1,2,3",
     True, 1e9, 1e-9, {"dx": 1}, object(), ("0.1", "0.1"), None, "auto", 10**400],
)  # fmt: skip
def test_unusable_pixel_sizes_are_refused(pixel_size):
    with pytest.raises(DiffractionError, match="pixel_size") as caught:
        HeightField(FLAT, pixel_size)
    assert "\n" not in str(caught.value)


def test_large_fields_have_the_same_statistics_in_parts(monkeypatch, tmp_path):
    heights = rough(300).astype(np.float32)
    np.save(tmp_path / "scan.npy", heights)
    whole = HeightField.load(tmp_path / "scan.npy", pixel_size=PIXEL)
    monkeypatch.setattr(field_module, "LARGE", 1)
    parts = HeightField.load(tmp_path / "scan.npy", pixel_size=PIXEL)
    np.testing.assert_array_equal(parts.heights, heights)
    assert parts.rms_slope == pytest.approx(whole.rms_slope, rel=1e-12)
    assert parts.rms_height == pytest.approx(whole.rms_height, rel=1e-12)
    level = parts.treated(level="plane")
    assert "RMS change" in level.history[-1]
    tilt = tilted(parts, 0.4)
    monkeypatch.undo()
    assert level.history == whole.treated(level="plane").history
    assert tilt is tilted(whole, 0.4)
