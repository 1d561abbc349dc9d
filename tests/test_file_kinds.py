"""Kinds of files: content decides, else the suffix; images are decoded without other programs."""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest
from PIL import EpsImagePlugin, Image

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField
from mitsuba_diffraction.columns import save_rows
from mitsuba_diffraction.files import FileKind, kind_of
from mitsuba_diffraction.images import FORMATS, open_image, save_figure
from mitsuba_diffraction.scene.hologram import hologram
from mitsuba_diffraction.scene.logo import areas
from tests.support.hostile import postscript
from tests.support.orders import thin_grating
from tests.support.patches import DEFAULTS, PATCH


def tiff(tag: int) -> bytes:
    """A TIFF whose first page has one tag, after its data."""
    entry = struct.pack("<HHII", tag, 4, 1, 0)
    return b"II*\0" + struct.pack("<I", 12) + b"data" + struct.pack("<H", 1) + entry + bytes(4)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("a.toml", FileKind.RECIPE), ("a.XML", FileKind.SCENE), ("a.obj", FileKind.MESH),
        ("a.glb", FileKind.MESH), ("a.png", FileKind.IMAGE), ("a.exr", FileKind.EXR),
        ("a.csv", FileKind.TEXT), ("a.npy", FileKind.NPY), ("a.spm", FileKind.INSTRUMENT),
        ("a", FileKind.INSTRUMENT),
    ],
)  # fmt: skip
def test_the_suffix_decides_without_telling_content(tmp_path, name, kind):
    assert kind_of(tmp_path / name) is kind  # missing
    (tmp_path / name).write_bytes(b"1 2 3")
    assert kind_of(tmp_path / name) is kind


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"\x89PNG\r\n\x1a\n", FileKind.IMAGE), (b"\x93NUMPY", FileKind.NPY),
        (b"\xff\xd8\xff", FileKind.JPEG), (tiff(256), FileKind.IMAGE),
        (tiff(50432), FileKind.INSTRUMENT), (tiff(0x8042), FileKind.INSTRUMENT),
        (b"II*\0", FileKind.IMAGE), (b"CDF\1 of others", FileKind.INSTRUMENT),
    ],
)  # fmt: skip
def test_content_decides_before_the_suffix(tmp_path, content, kind):
    file = tmp_path / "a.jpk"
    file.write_bytes(content)
    assert kind_of(file) is kind


def test_plots_and_tables_that_the_program_writes_are_told_from_heights(tmp_path):
    from matplotlib.figure import Figure

    save_figure(tmp_path / "own.png", Figure())
    Figure().savefig(tmp_path / "other.png")  # as pyplot.imsave, which may hold heights
    assert kind_of(tmp_path / "own.png") is FileKind.RESULT
    assert kind_of(tmp_path / "other.png") is FileKind.IMAGE
    save_rows(tmp_path / "survey.csv", ["file", "sample", "reason"], [])
    save_rows(tmp_path / "spectrum.csv", ["wl", "light30"], np.ones((2, 2)))
    np.savez_compressed(tmp_path / "evaluation.npz", wavelengths=np.ones(3), angles=np.ones(3))
    for name in ("survey.csv", "spectrum.csv", "evaluation.npz"):
        assert kind_of(tmp_path / name) is FileKind.RESULT
        with pytest.raises(DiffractionError, match="is a plot or table of results, which has no"):
            HeightField.load(tmp_path / name, pixel_size=0.1)


def test_tables_are_told_from_pictures_and_other_netcdf(tmp_path):
    DiffractionTable.build(PATCH, **DEFAULTS).save(tmp_path / "table.exr")
    thin_grating(0.6, counts=(2, 2, 1)).save(tmp_path / "orders.nc")
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(tmp_path / "a.tif")
    for name, kind in [
        ("table.exr", FileKind.TABLE), ("orders.nc", FileKind.ORDERS), ("a.tif", FileKind.IMAGE),
    ]:  # fmt: skip
        content = (tmp_path / name).read_bytes()
        (tmp_path / "misnamed.toml").write_bytes(content)
        assert kind_of(tmp_path / name) is kind_of(tmp_path / "misnamed.toml") is kind


@pytest.fixture
def programs(monkeypatch):
    """Calls of Ghostscript."""
    calls = []
    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", lambda *a, **k: calls.append(a))
    return calls


READERS = {
    "logo": lambda file: areas(file),
    "hologram": lambda file: hologram(str(file), periods=1.0, orientations=0.0, period=1.0),
    "heights": lambda file: HeightField.load(file, pixel_size=0.1, max_height=0.1),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".bmp", ".eps"])
def test_postscript_is_no_image(tmp_path, programs, reader, suffix):
    file = postscript(tmp_path / f"picture{suffix}")
    with pytest.raises(DiffractionError):
        READERS[reader](file)
    assert programs == []


@pytest.mark.parametrize("name", sorted({*FORMATS} - {"DIB"}))
def test_images_of_cameras_and_drawing_programs_open(name):
    stream = io.BytesIO()
    Image.new("L", (3, 2)).save(stream, format=name)
    with open_image(stream) as image:
        assert image.size == (3, 2)
        image.load()
