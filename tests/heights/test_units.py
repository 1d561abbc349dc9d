"""Units that a file lacks or gets wrong are given instead, one line says so, and notes are one."""

from __future__ import annotations

import warnings

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError, DiffractionWarning, HeightField
from mitsuba_diffraction.heights.read import LoadOptions
from tests.support.refusals import refusal

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
