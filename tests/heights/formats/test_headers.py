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


def ibw(path):
    labels = [b"layers".ljust(32, b"\0"), b"HeightRetrace".ljust(32, b"\0")]
    data = (1e-11 * COUNTS).astype("<f4").tobytes()
    wave = bytearray(320)
    struct.pack_into("<i", wave, 12, COUNTS.size)
    struct.pack_into("<h", wave, 16, 2)
    struct.pack_into("<4i", wave, 68, NX, NY, 1, 0)
    struct.pack_into("<2d", wave, 84, SIZE[0] / NX * 1e-6, SIZE[1] / NY * 1e-6)
    for at in (148, 152, 156):
        wave[at : at + 1] = b"m"
    sizes = (320 + len(data), 0, 0, 0, *4 * [0], 0, 0, 64, 0, 0, 0, 0)
    head = struct.pack("<hh15i", 5, 0, *sizes)
    words = int(np.frombuffer(head + bytes(wave), "<u2").sum())
    head = struct.pack("<hH15i", 5, -words % 65536, *sizes)
    path.write_bytes(head + bytes(wave) + data + b"".join(labels))


def nid(path):
    text = f"""[DataSet]
GroupCount=1
Gr0-Count=1
Gr0-Ch0=DataSet-0:0
[DataSet-Info]
Date=01-02-2020
Time=10:20:30
[DataSet-0:0]
SaveMode=Binary
SaveOrder=Intel
SaveSign=Signed
SaveBits=16
Points={NX}
Lines={NY}
Frame=Scan forward
Dim0Unit=m
Dim0Range={SIZE[0] * 1e-6}
Dim1Unit=m
Dim1Range={SIZE[1] * 1e-6}
Dim2Name=Z-Axis
Dim2Unit=m
Dim2Min=0
Dim2Range=6.5536e-7
"""
    path.write_bytes(text.replace("\n", "\r\n").encode() + b"#!" + COUNTS.tobytes())


def mdt(path):
    scales = struct.pack(
        "<ffhffhffh", 0, SIZE[0] / NX, -2, 0, SIZE[1] / NY, -2, 0, 1e-2, -1
    )  # fmt: skip
    fields = (scales[:20] + scales[20:] + struct.pack("<BBHH", 0, 0, NX, NY)).ljust(50, b"\0")
    body = fields + struct.pack("<4H", 0, NX, NY, 0) + COUNTS.tobytes()
    frame = struct.pack("<IHH6HH", 22 + len(body), 0, 0, 2020, 1, 1, 1, 1, 1, len(fields)) + body
    head = b"\x01\xb0\x93\xff" + struct.pack("<I4xH19x", len(frame), 0)
    path.write_bytes(head + frame)


def tiff(path, *pages):
    tifffile = pytest.importorskip("tifffile", reason="TIFF files need the extra afm")
    with tifffile.TiffWriter(path) as writer:
        for values, tags in pages:
            writer.write(values, extratags=[(*tag, True) for tag in tags], metadata=None)


def park(path):
    wide = "Height".encode("utf-16-le").ljust(64, b"\0"), b"".ljust(16, b"\0")
    head = struct.pack(
        "<I64s16sdIIIIdIdIII6d16s5d16siiiIII", 0, *wide, 0, 0, 0, NX, NY, 0, 0, 0, 1, 0, 0, *SIZE,
        0, 0, 0, 0, wide[1], 0, 0, 1e-5, 1, 0, "um".encode("utf-16-le").ljust(16, b"\0"),
        0, 0, 0, 0, 0, 0,
    )  # fmt: skip
    data = COUNTS.tobytes()
    tags = (50432, 4, 1, 0x0E031301), (50433, 4, 1, 0x1000001)
    blocks = (50434, 7, len(data), data), (50435, 7, len(head), head)
    tiff(path, (np.zeros((4, 4), np.uint8), (*tags, *blocks)))


def jpk(path):
    grid = [(tag, 12, 1, 1e-6 * size) for tag, size in zip((0x8042, 0x8043), SIZE, strict=True)]
    date = (0x8003, 2, 0, "2020-01-02 10:20:30")
    texts = {0x8052: "Height", 0x8081: "h", 0x8090: "h", 0x80A1: "h", 0x80A2: "m"}
    texts[0x80A3] = "LinearScaling"
    tags = [(tag, 2, 0, text) for tag, text in texts.items()]
    tags += [(0x8051, 4, 1, 0), (0x8080, 4, 1, 1), (0x80A4, 12, 1, 1e-11), (0x80A5, 12, 1, 0.0)]
    thumbnail = np.zeros((4, 4), np.uint8)
    tiff(path, (thumbnail, [date, *grid]), (COUNTS.astype(np.int32), tags))


FILES = {
    "a.gwy": gwyddion, "a.x3p": x3p, "a.sdf": sdf, "b.sdf": binary_sdf, "a.top": wsxm, "a.mi": mi,
    "a.bcr": bcr, "a.ibw": ibw, "a.nid": nid, "a.mdt": mdt, "a.tiff": park, "a.jpk": jpk,
    "a.spm": lambda path: path.write_bytes(nanoscope(COUNTS, scan_size="4 1.5 ~m")),
}  # fmt: skip


#: Formats whose first line is the lowest of the picture; WSxM turns it by half a turn besides.
UPWARDS = ("a.mi", "a.ibw", "a.nid", "a.mdt", "a.tiff", "a.jpk", "a.top", "a.spm")


@pytest.mark.parametrize("name", FILES)
def test_pictures_stand_as_instruments_show_them_and_the_header_wins(tmp_path, monkeypatch, name):
    path = tmp_path / name
    FILES[name](path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DiffractionWarning)
        field = HeightField.load(path, level="none")
    lines = COUNTS if name in UPWARDS else COUNTS[::-1]
    lines = lines[:, ::-1] if name == "a.top" else lines
    assert np.corrcoef(field.heights.ravel(), lines.ravel())[0, 1] == pytest.approx(1.0, abs=1e-6)
    assert field.extent == pytest.approx(SIZE, rel=1e-6)
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


def test_a_header_without_a_line_says_so(tmp_path):
    wsxm(tmp_path / "a.top")
    content = (tmp_path / "a.top").read_bytes()
    (tmp_path / "a.top").write_bytes(content.replace(b"Number of rows", b"Number of lines"))
    assert "it has no 'Number of rows'" in refusal(tmp_path / "a.top")


def test_a_unit_of_one_axis_is_its_own(tmp_path):
    mdt(tmp_path / "a.mdt")
    content = (tmp_path / "a.mdt").read_bytes()
    y = struct.pack("<fh", SIZE[1] / NY, -2)
    (tmp_path / "a.mdt").write_bytes(content.replace(y, struct.pack("<fh", 1e3 * SIZE[1] / NY, -1)))
    with pytest.warns(DiffractionWarning, match=r"4 x 1\.5 µm.* 4 x 1500 µm"):
        field = HeightField.load(tmp_path / "a.mdt", level="none")
    assert field.extent == pytest.approx(SIZE, rel=1e-6)


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
