"""The headers of instrument files are asked beside the library that reads them."""

from __future__ import annotations

import struct
import warnings

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.formats import instruments
from tests.support.instruments import nanoscope
from tests.support.refusals import refusal

topographies = pytest.importorskip(
    "SurfaceTopography", reason="instrument files need the extra afm"
)

NX, NY, SIZE = 24, 12, (4.0, 1.5)
COUNTS = np.random.default_rng(4).integers(-3000, 3000, (NY, NX)).astype("<i2")


def gwyddion(path):
    heights = topographies.Topography(COUNTS.T * 1e-5, SIZE, unit="µm")
    heights.to_gwy(str(path))


def x3p(path):
    topographies.Topography(COUNTS.T * 1e-5, SIZE, unit="µm").to_x3p(str(path))


def sdf(path):
    head = {
        "ManufacID": "m", "CreateDate": "040120100853", "ModDate": "040120100853",
        "NumPoints": NX, "NumProfiles": NY, "Xscale": SIZE[0] / NX * 1e-6,
        "Yscale": SIZE[1] / NY * 1e-6, "Zscale": 1e-11, "Zresolution": 1e-12, "Compression": 0,
        "DataType": 7, "CheckType": 0,
    }  # fmt: skip
    lines = [f"{key} = {value}" for key, value in head.items()]
    rows = [" ".join(map(str, row)) for row in COUNTS]
    path.write_text("\n".join(["aISO-1.0", *lines, "*", *rows, "*", ""]))


def binary_sdf(path):
    steps = (SIZE[0] / NX * 1e-6, SIZE[1] / NY * 1e-6, 1e-11, 1e-12)
    head = struct.pack("<8s10s12s12sHH4dBBB", b"bISO-1.0", b"", b"", b"", NX, NY, *steps, 0, 5, 0)
    path.write_bytes(head + COUNTS.tobytes())


def wsxm(path):
    lines = [
        "WSxM file copyright UAM", "SxM Image file", "Image header size: 0000", "[Control]",
        f"    X Amplitude: {SIZE[0]} um", f"    Y Amplitude: {1e3 * SIZE[1]} nm", "[General Info]",
        "    Image Data Type: short", f"    Number of columns: {NX}", f"    Number of rows: {NY}",
        "    Z Amplitude: 50 nm", "[Miscellaneous]", f"    Maximum: {COUNTS.max()}",
        f"    Minimum: {COUNTS.min()}", "[Header end]", "",
    ]  # fmt: skip
    path.write_bytes("\r\n".join(lines).encode() + COUNTS.tobytes())


def mi(path):
    fields = {
        "fileType": "Image", "xPixels": NX, "yPixels": NY, "xLength": SIZE[0] * 1e-6,
        "yLength": SIZE[1] * 1e-6, "bufferLabel": "Topography", "bufferUnit": "um",
        "bufferRange": 0.5, "data": "BINARY",
    }  # fmt: skip
    text = "".join(f"{key:14}{value}\n" for key, value in fields.items())
    path.write_bytes(text.encode() + COUNTS.tobytes())


def bcr(path):
    lines = [
        "fileformat = bcrstm", "headersize = 2048", f"xpixels = {NX}", f"ypixels = {NY}",
        f"xlength = {1e3 * SIZE[0]}", f"ylength = {1e3 * SIZE[1]}", "bit2nm = 0.01", "",
    ]  # fmt: skip
    path.write_bytes("\n".join(lines).encode().ljust(2048) + COUNTS.tobytes())


FILES = {
    "a.gwy": gwyddion, "a.x3p": x3p, "a.sdf": sdf, "b.sdf": binary_sdf, "a.top": wsxm, "a.mi": mi,
    "a.bcr": bcr,
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_the_header_wins_over_the_library(tmp_path, monkeypatch, name):
    path = tmp_path / name
    FILES[name](path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DiffractionWarning)
        assert HeightField.load(path, level="none").extent == pytest.approx(SIZE, rel=1e-6)
    honest = instruments._read_channel

    def square(*args):
        raw = honest(*args)
        raw.pixel_size = (raw.pixel_size[0], SIZE[0] / NY)
        return raw

    monkeypatch.setattr(instruments, "_read_channel", square)
    with pytest.warns(DiffractionWarning, match=r"4 x 1\.5 µm.* 4 x 4 µm"):
        field = HeightField.load(path, level="none")
    assert field.extent == pytest.approx(SIZE, rel=1e-6)


def test_heights_that_the_header_contradicts_are_refused(tmp_path, monkeypatch):
    wsxm(tmp_path / "a.top")
    honest = instruments._read_channel

    def thousandfold(*args):
        raw = honest(*args)
        raw.values = 1e3 * raw.values
        return raw

    monkeypatch.setattr(instruments, "_read_channel", thousandfold)
    message = refusal(tmp_path / "a.top")
    assert "0.05 µm" in message
    assert "50 µm" in message


def test_a_capture_that_was_stopped_has_a_part_of_the_slow_axis(tmp_path):
    stated = "4 4 ~m\r\n\\Aspect Ratio: 2:1"
    content = nanoscope(COUNTS, scan_size=stated)
    lines = "\r\n\\".join([
        "\\*Ciao scan list", "Scan Size: 4 ~m", "Slow Axis Size: 2 ~m", f"Samps/line: {NX}",
        f"Lines: {2 * NY}",
    ])  # fmt: skip
    content = content.replace(b"\\*Ciao scan list", lines.encode(), 1)
    path = tmp_path / "a.spm"
    path.write_bytes(content.replace(b"\0" * (len(lines) - 16), b"", 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error", DiffractionWarning)
        assert HeightField.load(path, level="none").extent == pytest.approx((4.0, 1.0))


def test_the_reason_is_the_format_s_own(tmp_path):
    import zipfile

    x3p(tmp_path / "a.x3p")
    with zipfile.ZipFile(tmp_path / "a.x3p") as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    for old, new in ((b">SUR<", b">PRF<"), (b">D<", b">Q<")):
        with zipfile.ZipFile(tmp_path / "b.x3p", "w") as archive:
            for name, content in parts.items():
                archive.writestr(name, content.replace(old, new))
        message = refusal(tmp_path / "b.x3p")
        assert "X3P" in message
        assert "known kind" not in message


def test_of_maps_without_units_the_one_called_height_is_read_or_all_are_listed(tmp_path):
    h5py = pytest.importorskip("h5py", reason="HDF5 files need h5py")
    path = tmp_path / "a.h5"
    first, second = np.zeros((5, 4)), np.arange(20.0).reshape(5, 4)
    lengths = {"pixel_size": 0.1, "height_unit": "nm", "level": "none"}
    with h5py.File(path, "w") as file:
        file["scan/phase"], file["scan/Height_trace"] = first, second
    field = HeightField.load(path, **lengths)
    assert field.range == pytest.approx(0.019)
    assert "Height_trace" in field.history[0]
    # (5, 4): five along x, as the note says
    assert field.shape == (4, 5)
    assert "first index of the array runs along x" in field.history[0]
    with h5py.File(path, "w") as file:
        file["a"], file["b"] = first, second
    message = refusal(path, **lengths)
    assert "0 'a', 1 'b'" in message
    assert "channel" in message
    assert HeightField.load(path, channel="b", **lengths).range == pytest.approx(0.019)
