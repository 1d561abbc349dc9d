"""Images of others are decoded without other programs."""

from __future__ import annotations

import io

import pytest
from PIL import EpsImagePlugin, Image

from mitsuba_diffraction import DiffractionError, HeightField
from mitsuba_diffraction.images import FORMATS, open_image
from mitsuba_diffraction.scene.hologram import hologram
from mitsuba_diffraction.scene.logo import areas
from tests.support.hostile import postscript


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
