"""Instrument files are read in their own units, and what they lack is named."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from mitsuba_diffraction.heights.field import HeightField
from tests.support.instruments import nanoscope
from tests.support.refusals import refusal

surface_topography = pytest.importorskip(
    "SurfaceTopography", reason="instrument files need the extra afm"
)

NX, NY = 6, 4
COUNTS = np.random.default_rng(8).integers(-3000, 3000, (NY, NX)).astype("<i2")


def write(tmp_path, *args, name="scan.001", length=None, **kwargs):
    path = tmp_path / name
    path.write_bytes(nanoscope(COUNTS, *args, **kwargs)[:length])
    return path


def test_heights_and_size_come_in_the_units_of_the_file(tmp_path):
    field = HeightField.load(write(tmp_path))
    # 0.5 V over 2^16 counts, 100 nm/V; the file's first line is the bottom of the picture
    assert field.heights == pytest.approx(COUNTS * (0.5 / 2**16 * 100 * 1e-3), rel=1e-12)
    assert field.pixel_size == pytest.approx((3 / NX, 2 / NY), rel=1e-12)
    assert "ZSensor" in field.history[0]


@pytest.mark.parametrize(("unit", "in_micrometres"), [("pm", 1e-6), ("um", 1), ("nm", 1e-3)])
def test_any_unit_of_length_will_do(tmp_path, unit, in_micrometres):
    field = HeightField.load(write(tmp_path, [("Height", unit)], scan_size="300 nm"))
    assert field.range == pytest.approx(np.ptp(COUNTS) * 0.5 / 2**16 * 100 * in_micrometres)
    assert field.pixel_size == pytest.approx((0.3 / NX, 0.3 / NY), rel=1e-12)


def test_height_channel_is_found_among_others(tmp_path):
    path = write(tmp_path, [("AmplitudeError", "nm"), ("ZSensor", "nm"), ("Phase", "deg")])
    field = HeightField.load(path)
    assert "'ZSensor', the only height channel" in field.history[0]


def test_of_several_height_channels_the_first_is_taken_and_all_are_listed(tmp_path):
    field = HeightField.load(write(tmp_path, [("Height", "nm"), ("ZSensor", "nm")]))
    assert "'Height', the first height channel" in field.history[0]
    assert "'ZSensor'" in field.history[0]


def test_a_size_that_no_scan_has_is_asked_for(tmp_path):
    path = write(tmp_path, scan_size="3 2 m")
    assert "pixel_size" in refusal(path)
    assert HeightField.load(path, pixel_size=0.05).pixel_size == (0.05, 0.05)


def test_channel_is_chosen_by_name_or_index(tmp_path):
    path = write(tmp_path, [("Height", "nm"), ("Deflection", "nm")])
    for channel in ("Deflection", "deflection", 1, "1"):
        assert "'Deflection', chosen" in HeightField.load(path, channel=channel).history[0]
    assert "is not one of 0 'Height', 1 'Deflection'" in refusal(path, channel="Phase")
    assert "is not one of" in refusal(path, channel=2)
    assert "is not one of" in refusal(path, channel=-1)
    assert "channel=1.5" in refusal(path, channel=1.5)


def test_channels_of_one_name_need_the_index(tmp_path):
    path = write(tmp_path, [("Height", "nm"), ("Height", "nm")])
    assert "index" in refusal(path, channel="Height")
    assert HeightField.load(path, channel=1).shape == (NY, NX)


def test_files_without_heights_say_what_they_have(tmp_path):
    assert "no height channel among 0 'Phase'" in refusal(write(tmp_path, [("Phase", "deg")]))
    path = write(tmp_path, [("Phase", "deg")])
    assert "height_unit" in refusal(path, channel=0)


@pytest.mark.parametrize(
    ("option", "value"),
    [("level", "flat"), ("fill", "biharmonic"), ("periodic", True), ("clip", "few"), ("clip", 0)],
)
def test_unknown_options_name_the_choices(tmp_path, option, value):
    message = refusal(write(tmp_path), **{option: value})
    assert message.startswith(option)
    assert repr(value) in message


def test_two_levels_at_once_are_told_how_to_be_two_treatments(tmp_path):
    assert "HeightField.treated" in refusal(write(tmp_path), level="lines,quadratic")


def test_gwyddion_files_are_read(tmp_path):
    topography = surface_topography.Topography(np.arange(20.0).reshape(5, 4), (5, 8), unit="nm")
    topography.to_gwy(str(tmp_path / "a.gwy"))
    field = HeightField.load(tmp_path / "a.gwy")
    assert field.heights == pytest.approx(np.arange(20).reshape(5, 4).T[::-1] * 1e-3, rel=1e-12)
    assert field.pixel_size == pytest.approx((0.001, 0.002), rel=1e-12)


def test_undefined_points_are_refused_or_filled(tmp_path):
    heights = np.ma.masked_equal(np.arange(20.0).reshape(5, 4), 6)
    surface_topography.Topography(heights, (5, 8), unit="nm").to_netcdf(str(tmp_path / "a.nc"))
    assert "1 of 20 points" in refusal(tmp_path / "a.nc")
    field = HeightField.load(tmp_path / "a.nc", fill="harmonic")
    # the mean of the four neighbours 2, 10, 5, 7
    assert field.heights[::-1].T[1, 2] == pytest.approx(6e-3, rel=1e-6)


def test_units_that_are_not_stated_are_not_guessed(tmp_path):
    surface_topography.Topography(np.eye(4), (1, 1)).to_netcdf(str(tmp_path / "a.nc"))
    assert "states no unit for its heights; give height_unit" in refusal(tmp_path / "a.nc")
    known = {"height_unit": "nm", "pixel_size": 0.05}
    with warnings.catch_warnings():  # nothing of the file is overridden
        warnings.simplefilter("error", DiffractionWarning)
        field = HeightField.load(tmp_path / "a.nc", **known)
    assert field.range == pytest.approx(1e-3)
    assert field.pixel_size == (0.05, 0.05)


def test_line_scans_and_scattered_points_are_refused(tmp_path):
    line = surface_topography.UniformLineScan(np.arange(8.0), 4, unit="nm")
    line.to_netcdf(str(tmp_path / "line.nc"))
    assert "line scan" in refusal(tmp_path / "line.nc")
    np.savetxt(tmp_path / "scattered.xyz", np.random.default_rng(0).random((9, 3)))
    assert "grid" in refusal(tmp_path / "scattered.xyz")


def test_a_channel_on_a_non_uniform_grid_is_refused(tmp_path, monkeypatch):
    from SurfaceTopography.IO.DI import DIReader

    class Scattered(DIReader):
        @property
        def channels(self):
            for channel in super().channels:
                channel._uniform = False
            return super().channels

    monkeypatch.setattr("SurfaceTopography.IO.open_topography", Scattered)
    assert "not on a uniform grid" in refusal(write(tmp_path))


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    assert "(extra afm)" in refusal(write(tmp_path))


def test_unknown_files_list_what_is_known(tmp_path):
    (tmp_path / "a.xyzzy").write_bytes(b"nothing that anyone reads" * 9)
    assert "not a height field of a known kind" in refusal(tmp_path / "a.xyzzy")


@pytest.mark.parametrize("length", [1, 30, 400, 4000, 4097, 4096 + COUNTS.nbytes - 1])
def test_truncated_instrument_files_are_refused(tmp_path, length):
    refusal(write(tmp_path, length=length))


def test_nanoscope_file_needs_no_option(shared_afm):
    path = shared_afm / "nanoscope-10um.di"
    measured = HeightField.load(path, level="none")
    assert measured.shape == (512, 512)
    assert measured.extent == pytest.approx((10, 10), rel=1e-12)
    # -25000 to 32760 counts, 1.5 V over 2^16 at 363.9 nm/V (its "Sens. ZsensSens")
    assert measured.range == pytest.approx(0.4811, rel=1e-3)
    assert "'ZSensor', the only height channel" in measured.history[0]

    level = HeightField.load(path)
    y, x = np.mgrid[:512, :512].reshape(2, -1)
    plane = np.stack([x, y, np.ones_like(x)], -1)
    removed = (measured.heights - level.heights).ravel()
    fit = np.linalg.lstsq(plane, measured.heights.ravel(), rcond=None)[0]
    # the least squares plane, but for its mean
    tilt = plane[:, :2] @ fit[:2]
    np.testing.assert_allclose(removed - removed.mean(), tilt - tilt.mean(), atol=1e-6)


HEADS = [
    # images and arrays
    b"", b"\x89PNG\r\n\x1a\n", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"BM", b"II*\0", b"MM\0*",
    b"\x76\x2f\x31\x01", b"\x76\x2f\x31\x01\x02\0\0\0", b"\x93NUMPY\x01\0",
    # instruments
    nanoscope(COUNTS)[:600], b"GWYP", b"PK\3\4", b"\x89HDF\r\n\x1a\n", b"CDF\1", b"aBCR-0.0",
    b"\\*File list\r\n", b"\5\0", b"DSS\1", b"WSxM file",
]  # fmt: skip


@settings(max_examples=80)
@given(st.sampled_from(HEADS), st.binary(max_size=300), st.sampled_from([".png", ".exr", ".spm"]))
def test_random_bytes_are_one_clear_line(tmp_path, head, tail, suffix):
    """tests/fuzz has whole files with random damage."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(head + tail)
    for options in ({}, {"pixel_size": 0.1, "max_height": 0.5}):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DiffractionWarning)  # values that are overridden
                HeightField.load(path, **options)
        except DiffractionError as error:
            assert "\n" not in str(error)


def test_the_header_s_aspect_ratio_wins_over_the_library_and_is_said(tmp_path):
    counts = np.round(3000 * np.sin(np.arange(24) / 3.0))[:, None] * np.ones(48)
    square, strip = "10 10 ~m", "10 10 ~m\r\n\\Aspect Ratio: 2:1"
    path = tmp_path / "strip.spm"
    path.write_bytes(nanoscope(counts, scan_size=strip))
    with pytest.warns(DiffractionWarning, match=r"10 x 5 µm .aspect ratio 2:1.* 10 x 10 µm"):
        field = HeightField.load(path)
    assert field.extent == pytest.approx((10.0, 5.0))
    for stated in (square, "10 5 ~m"):
        path.write_bytes(nanoscope(counts, scan_size=stated))
        with warnings.catch_warnings():
            warnings.simplefilter("error", DiffractionWarning)
            extent = HeightField.load(path, level="none").extent
        assert extent == pytest.approx([float(word) for word in stated.split()[:2]])
