"""HeightField: what it accepts and computes; units that a file lacks or gets wrong are given."""

from __future__ import annotations

import math
import warnings

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError, DiffractionWarning, HeightField
from mitsuba_diffraction.heights import field as field_module
from mitsuba_diffraction.heights.read import LoadOptions
from mitsuba_diffraction.heights.validity import tilted
from mitsuba_diffraction.limits import MOST_PIXELS
from tests.support.refusals import refusal
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


HEIGHTS = np.random.default_rng(3).normal(size=(6, 5))


@pytest.fixture
def text(tmp_path):
    """A Gwyddion text file that says nm, of a patch of 5 × 3 µm."""
    path = tmp_path / "scan.txt"
    header = "Width: 5 \u00b5m\nHeight: 3 \u00b5m\nValue units: nm"
    np.savetxt(path, HEIGHTS, header=header, encoding="utf-8")
    return path


def loaded(path, **options):
    """A field and the one line that it was loaded with, which is in its history, too."""
    with pytest.warns(DiffractionWarning) as caught:
        field = HeightField.load(path, **options)
    (line,) = [str(warning.message) for warning in caught]
    assert field.history[-1] in line
    return field, line


def test_height_unit_overrides_what_the_file_says(text):
    stated = HeightField.load(text)
    field, line = loaded(text, height_unit="pm")
    assert field.heights == pytest.approx(stated.heights * 1e-3, rel=1e-12)
    assert line.endswith("scan.txt': height_unit overrides the file's: in pm, not nm")


def test_pixel_size_overrides_what_the_file_says(text):
    field, line = loaded(text, pixel_size="0.2, 0.4")
    assert field.pixel_size == (0.2, 0.4)
    assert np.array_equal(field.heights, HeightField.load(text).heights)
    assert line.endswith("pixels of 0.2 x 0.4 µm, not 1 x 0.5 µm")


def test_max_height_is_the_span_of_heights_whatever_their_unit(text, tmp_path):
    np.save(tmp_path / "a.npy", HEIGHTS)
    for path, more in ((text, {}), (tmp_path / "a.npy", {"pixel_size": 0.1})):
        field, line = loaded(path, max_height=0.3, **more)
        assert field.range == pytest.approx(0.3, rel=1e-12)
        assert "heights span 0.3 µm" in line


def test_what_agrees_with_the_file_or_fills_what_it_leaves_open_is_not_said(text, tmp_path):
    Image.fromarray(np.arange(30, dtype=np.uint8).reshape(6, 5)).save(tmp_path / "a.png")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert HeightField.load(text, height_unit="nm", pixel_size=(1.0001, 0.5)).history == ()
        HeightField.load(tmp_path / "a.png", max_height=0.3, pixel_size=0.1)


def test_exr_and_arrays_may_be_in_nanometres(tmp_path):
    np.save(tmp_path / "a.npy", HEIGHTS)
    channels = {"Y": HEIGHTS[::-1].astype(np.float32)}
    OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(str(tmp_path / "a.exr"))
    for name in ("a.npy", "a.exr"):
        with warnings.catch_warnings():  # nothing of the file is overridden
            warnings.simplefilter("error")
            field = HeightField.load(tmp_path / name, height_unit="nm", pixel_size=0.1)
        assert field.heights == pytest.approx(HEIGHTS * 1e-3, rel=1e-6)  # single precision
        assert "nm" in field.history[-1]


def test_contradictions_and_unknown_units_are_refused(text, tmp_path):
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(tmp_path / "a.png")
    both = {"max_height": 1, "height_unit": "nm"}
    assert "without max_height" in refusal(text, **both)
    assert "grey levels" in refusal(tmp_path / "a.png", height_unit="nm", pixel_size=0.1)
    assert "must be a unit of length" in refusal(text, height_unit="V")
    np.save(tmp_path / "flat.npy", np.zeros((4, 4)))
    assert "is flat" in refusal(tmp_path / "flat.npy", max_height=1, pixel_size=0.1)
    assert LoadOptions.parse(height_unit="auto").height_unit is None


@pytest.mark.parametrize("offset", [76e3, -1e9])
def test_a_constant_offset_does_not_matter(tmp_path, offset):
    np.save(tmp_path / "far.npy", HEIGHTS + offset)
    far = HeightField.load(tmp_path / "far.npy", pixel_size=0.1)
    # doubles near the offset are so far apart
    assert far.heights == pytest.approx(HEIGHTS - HEIGHTS.mean(), abs=2 * np.spacing(abs(offset)))
    assert f"a constant offset of {offset + HEIGHTS.mean():.6g} µm was subtracted" in far.history
    with pytest.raises(DiffractionError, match=r"span 2e\+04"):
        HeightField(HEIGHTS * 0 + np.linspace(offset, offset + 2e4, 5), 0.1)


def questions(field):
    return [line for line in field.validity() if "in nm?" in line]


def test_a_unit_that_the_file_states_is_not_doubted(text, tmp_path):
    path = tmp_path / "wide.txt"
    header = "Width: 500 \u00b5m\nHeight: 300 \u00b5m"
    np.savetxt(path, HEIGHTS, header=header, encoding="utf-8")
    assert questions(HeightField.load(path)) == []
    np.save(tmp_path / "wide.npy", HEIGHTS)
    assert len(questions(HeightField.load(tmp_path / "wide.npy", pixel_size=100.0))) == 1


def test_the_remedies_for_nanometres_leave_no_question(tmp_path):
    np.save(tmp_path / "nm.npy", 1e2 * HEIGHTS)
    (both,) = questions(HeightField.load(tmp_path / "nm.npy", pixel_size=50.0, level="none"))
    assert "both by 1000" in both
    remedied = {"pixel_size": 0.05, "height_unit": "nm", "level": "none"}
    assert questions(HeightField.load(tmp_path / "nm.npy", **remedied)) == []
    (heights,) = questions(HeightField.load(tmp_path / "nm.npy", pixel_size=0.5, level="none"))
    assert "height_unit=nm" in heights
    mended = HeightField.load(tmp_path / "nm.npy", pixel_size=0.5, height_unit="nm", level="none")
    assert questions(mended) == []
    wrong = HeightField.load(tmp_path / "nm.npy", pixel_size=0.001, height_unit="nm", level="none")
    (line, *_) = wrong.validity()
    assert questions(wrong) == []
    assert "pixel_size" in line
