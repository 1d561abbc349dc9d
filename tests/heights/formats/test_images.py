"""Grey images become heights, and nothing else does."""

from __future__ import annotations

import contextlib
import os
import struct
import sys
import warnings
import zlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.field import HeightField
from tests.support.refusals import refusal

RNG = np.random.default_rng(5)
BYTES = RNG.integers(0, 256, (5, 7), dtype=np.uint8)
SHORTS = RNG.integers(0, 65536, (5, 7), dtype=np.uint16)
FLOATS = RNG.normal(size=(5, 7)).astype(np.float32)


def write_exr(path, channels):
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    OpenEXR.File(header, channels).write(str(path))


WHITE = 0.5  # µm
PICTURES = [
    *((suffix, BYTES, BYTES / 255 * WHITE) for suffix in ("png", "bmp", "tif")),
    *((suffix, SHORTS, SHORTS / 65535 * WHITE) for suffix in ("png", "tif")),
    ("png", BYTES > 127, (BYTES > 127) * WHITE),
    *(("exr", np.abs(10 * FLOATS).astype(kind), None) for kind in ("f4", "f2", "u4")),
    ("tif", FLOATS, None),
]


@pytest.mark.parametrize(("suffix", "stored", "grey"), PICTURES)
def test_grey_is_a_share_of_max_height_floats_are_micrometres_and_the_top_row_has_the_largest_y(
    tmp_path, suffix, stored, grey
):
    path = tmp_path / f"a.{suffix}"
    if suffix == "exr":
        write_exr(path, {"height": stored})
    else:
        Image.fromarray(stored).save(path)
    options = {} if grey is None else {"max_height": str(WHITE)}
    field = HeightField.load(path, pixel_size="0.1, 0.2", **options)
    assert np.array_equal(field.heights, (stored if grey is None else grey)[::-1])
    assert field.pixel_size == (0.1, 0.2)
    assert field.name == path.name


def test_a_large_image_is_not_a_bomb(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 80)  # of 89 million: Pillow warns above it
    Image.new("L", (12, 10)).save(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        field = HeightField.load(path, pixel_size=0.01, max_height=1)
    assert field.shape == (10, 12)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 50)  # Pillow refuses twice as many
    with pytest.raises(DiffractionError, match="too large"):
        HeightField.load(path, pixel_size=0.01, max_height=1)


SIZES = {"pixel_size": 0.1, "max_height": 0.5}


@pytest.mark.parametrize(
    ("mode", "word"), [("RGB", "colours"), ("RGBA", "colours"), ("P", "palette"), ("LA", "transp")]
)
def test_colours_are_refused(tmp_path, mode, word):
    picture = Image.new("RGBA", (8, 8))
    picture.putpixel((2, 3), (90, 60, 30, 255) if word != "transp" else (90, 90, 90, 128))
    picture.convert(mode).save(tmp_path / "a.png")
    line = refusal(tmp_path / "a.png", **SIZES)
    assert word in line
    assert "8- or 16-bit greyscale" in line


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "LA"])
def test_grey_that_is_kept_as_colours_is_grey(tmp_path, mode):
    Image.fromarray(BYTES).convert(mode).save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.mode == mode
    field = HeightField.load(tmp_path / "a.png", **SIZES)
    assert np.array_equal(field.heights, BYTES[::-1] / 255 * 0.5)


def test_sixteen_bits_of_colour_are_not_read_as_eight(tmp_path):
    grey = np.dstack([SHORTS] * 3).astype(">u2")
    rows = b"".join(b"\0" + row.tobytes() for row in grey)

    def chunk(kind, content):
        body = kind + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    (tmp_path / "a.png").write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", 7, 5, 16, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )
    assert "16 bits each" in refusal(tmp_path / "a.png", **SIZES)


def test_a_jpeg_is_refused_for_what_it_is(tmp_path):
    Image.fromarray(BYTES).save(tmp_path / "a.png", format="JPEG")
    assert "is a JPEG, which is not read as heights" in refusal(tmp_path / "a.png", **SIZES)


def test_lengths_that_an_image_lacks_are_asked_for(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(BYTES).save(path)
    assert "max_height" in refusal(path, pixel_size=0.1)
    assert "max_height" in refusal(path, pixel_size=0.1, max_height="auto")
    assert "pixel_size" in refusal(path, max_height=0.1)
    both = refusal(path)
    assert "max_height=0.375 pixel_size=0.05" in both


@pytest.mark.parametrize("bad", [0, -1, float("nan"), float("inf"), "high", "", True, 1e9, (1, 2)])
def test_unusable_max_height_is_named(tmp_path, bad):
    path = tmp_path / "a.png"
    Image.fromarray(BYTES).save(path)
    assert "max_height" in refusal(path, pixel_size=0.1, max_height=bad)


def test_files_that_are_not_there_or_not_files(tmp_path):
    (tmp_path / "empty.png").touch()
    assert "does not exist" in refusal(tmp_path / "none.png", **SIZES)
    assert "folder" in refusal(tmp_path, **SIZES)
    assert "empty" in refusal(tmp_path / "empty.png", **SIZES)
    assert "null" in refusal(str(tmp_path / "a\0b"), **SIZES)
    assert "cannot read" in refusal("a" * 5000, **SIZES)


def test_one_pixel_and_several_pages_are_refused(tmp_path):
    Image.new("L", (1, 1)).save(tmp_path / "a.png")
    assert "1 x 1" in refusal(tmp_path / "a.png", **SIZES)
    page = Image.fromarray(BYTES)
    page.save(tmp_path / "a.tif", save_all=True, append_images=[page])
    assert "2 pages" in refusal(tmp_path / "a.tif", **SIZES)


def test_exr_with_several_channels_or_nan_is_refused(tmp_path):
    write_exr(tmp_path / "rgb.exr", {"RGB": np.dstack([FLOATS] * 3)})
    assert "3 channels" in refusal(tmp_path / "rgb.exr", pixel_size=0.1)
    write_exr(tmp_path / "nan.exr", {"Y": FLOATS * np.float32("nan")})
    assert "finite" in refusal(tmp_path / "nan.exr", pixel_size=0.1)


def test_exr_with_a_second_part_is_refused_before_it_is_decoded(tmp_path):
    window = (np.array([0, 0], np.int32), np.array([999, 999], np.int32))
    parts = [
        OpenEXR.Part({"type": OpenEXR.scanlineimage, "displayWindow": window}, {"Y": pixels}, name)
        for name, pixels in (("heights", FLOATS), ("other", np.zeros((1000, 1000), np.float32)))
    ]
    OpenEXR.File(parts).write(str(tmp_path / "two.exr"))
    content = (tmp_path / "two.exr").read_bytes()
    (tmp_path / "two.exr").write_bytes(content[: len(content) // 2])  # it need not even be there
    assert "has 2 parts" in refusal(tmp_path / "two.exr", pixel_size=0.1)


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tif", "a.exr"])
def test_truncated_files_are_refused(tmp_path, name, capfd):
    path = tmp_path / name
    if name == "a.exr":
        write_exr(path, {"Y": RNG.random((64, 64)).astype(np.float32)})
    else:
        Image.fromarray(RNG.integers(0, 256, (64, 64), dtype=np.uint8)).save(path)
    content = path.read_bytes()
    for share in (0.02, 0.3, 0.7, 0.9):
        path.write_bytes(content[: int(len(content) * share)])
        refusal(path, pixel_size=0.1, max_height=None if name == "a.exr" else 0.5)
    # OpenEXR prints why; streams of the process are nobody's to redirect; others print nothing
    out, err = capfd.readouterr()
    assert all(line.startswith("Warning: Exception raised reading") for line in out.splitlines())
    assert all("EXR_ERR" in line for line in err.splitlines())


def test_signalling_not_a_numbers_are_one_clear_line(tmp_path):
    heights = np.zeros((4, 4), np.float32)
    heights.view(np.uint32)[1, 2] = 0x7FA00000  # converting it raises the flag of an invalid value
    np.save(tmp_path / "a.npy", heights)
    refusal(tmp_path / "a.npy", pixel_size=0.1)


def test_a_tiff_whose_white_is_zero_is_as_high_as_it_is_bright(tmp_path):
    levels = np.broadcast_to(np.arange(64) * 1000, (64, 64)).astype(np.uint16)
    for photometric, stored in ((1, levels), (0, 65535 - levels)):
        path = tmp_path / f"{photometric}.tif"
        Image.fromarray(stored).save(path, tiffinfo={262: photometric})
        field = HeightField.load(path, pixel_size=0.1, max_height=1.0, level="none")
        assert field.heights == pytest.approx(levels / 65535, abs=1e-12), path


@pytest.mark.parametrize(
    ("orientation", "shown"),
    [
        (1, lambda rows: rows), (2, np.fliplr), (3, lambda rows: rows[::-1, ::-1]), (4, np.flipud),
        (6, lambda rows: np.rot90(rows, -1)), (8, np.rot90),
    ],
)  # fmt: skip
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_a_tiff_is_turned_as_it_is_to_be_shown(tmp_path, orientation, shown, dtype):
    """Pillow 13 maps integers into memory, by the sides of the turned picture."""
    levels, path = np.arange(24).reshape(6, 4), tmp_path / "turned.tif"
    Image.fromarray(levels.astype(dtype)).save(path, tiffinfo={274: orientation})
    whole = dtype is not np.float32
    heights = {"max_height": 1e-3 * np.iinfo(dtype).max} if whole else {}
    found = HeightField.load(path, pixel_size=0.1, level="none", **heights).heights
    np.testing.assert_allclose(found[::-1], shown(levels) * (1e-3 if whole else 1.0), atol=1e-9)


@pytest.mark.parametrize("order", "<>")
def test_doubles_of_a_tiff_are_read(tmp_path, order):
    tifffile = pytest.importorskip("tifffile", reason="TIFF files need the extra afm")
    heights, path = np.random.default_rng(2).random((5, 7)), tmp_path / "doubles.tif"
    tifffile.imwrite(path, heights, byteorder=order, metadata=None)
    found = HeightField.load(path, pixel_size=0.1, level="none").heights
    np.testing.assert_array_equal(found, heights[::-1])
    packed = struct.pack(f"{order}HHIH", 259, 3, 1, 1), struct.pack(f"{order}HHIH", 259, 3, 1, 8)
    path.write_bytes(path.read_bytes().replace(*packed))
    assert "save it uncompressed" in refusal(path, pixel_size=0.1)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(DiffractionError):
        HeightField.load(path, pixel_size=0.1)


def test_loading_in_threads_leaves_the_streams_of_the_process_alone(tmp_path):
    pixels = np.random.default_rng(0).random((64, 64)).astype(np.float32)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Y": pixels}).write(str(tmp_path / "a.exr"))
    Image.fromarray(np.uint8(255 * pixels)).save(tmp_path / "a.png")
    whole = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(whole[: len(whole) // 2])
    streams, number = (sys.stdout, sys.stderr), os.fstat(2).st_ino
    seen = []

    def load(n):
        with contextlib.suppress(DiffractionError):
            name = ("a.exr", "cut.exr", "a.png")[n % 3]
            HeightField.load(tmp_path / name, pixel_size=0.1, max_height=1 if n % 3 == 2 else None)
        seen.append((sys.stdout, sys.stderr) == streams and os.fstat(2).st_ino == number)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(load, range(200)))
    assert all(seen)
    assert (sys.stdout, sys.stderr) == streams
    assert os.fstat(2).st_ino == number
