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


@pytest.mark.parametrize(
    ("channels", "said"),
    [
        (["AmplitudeError", "ZSensor", "Phase"], "'ZSensor', the only height channel"),
        (["Height", "ZSensor"], "'Height', the first height channel"),
    ],
)
def test_the_first_height_channel_is_taken_and_all_are_listed(tmp_path, channels, said):
    field = HeightField.load(write(tmp_path, [(name, "nm") for name in channels]))
    assert said in field.history[0]
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


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    assert "(extra afm)" in refusal(write(tmp_path))


def test_unknown_files_list_what_is_known(tmp_path):
    (tmp_path / "a.xyzzy").write_bytes(b"nothing that anyone reads" * 9)
    assert "not a height field of a known kind" in refusal(tmp_path / "a.xyzzy")


@pytest.mark.parametrize("length", [1, 30, 400, 4000, 4097, 4096 + COUNTS.nbytes - 1])
def test_truncated_instrument_files_are_refused(tmp_path, length):
    refusal(write(tmp_path, length=length))


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
