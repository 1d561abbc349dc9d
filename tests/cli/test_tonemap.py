"""`tonemap`: the PNG of an EXR that exists."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction.optics.display import shown
from tests.support.room import QUICK, SCENE, png

__all__ = ["SCENE"]  # read by the fixture `scene`

pytestmark = pytest.mark.usefixtures("here")


def write(name, **channels):
    """Write an EXR of these channels."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(name)


@pytest.fixture
def light():
    """Colours from black to far beyond white, some outside the gamut."""
    rng = np.random.default_rng(1)
    return (rng.normal(0.6, 0.6, (16, 24, 3)) * 4.0 ** rng.normal(0, 2, (16, 24, 1))).astype("f4")


@pytest.mark.parametrize("view", ["natural", "standard"])
def test_the_png_shows_the_view_and_the_exr_stays(run, light, view):
    write("a.exr", RGB=light)
    before = Path("a.exr").read_bytes()
    assert run("tonemap", "a.exr", "--tonemap", view, "--exposure", "-1").code == 0
    # Mitsuba dithers between the two neighbours
    assert np.abs(png("a.png")[0] - 255 * shown(light / 2, view)).max() < 1.01
    assert Path("a.exr").read_bytes() == before


def test_render_writes_the_same_png(run, scene):
    assert run("render", scene, *QUICK, "-o", "a.exr", "--exposure", "1").code == 0
    assert run("tonemap", "a.exr", "-o", "b.png", "--exposure", "1").code == 0
    assert np.abs(png("a.png")[0].astype(int) - png("b.png")[0]).max() <= 1  # dithered


def test_luminance_and_alpha_are_shown(run, light):
    write("a.exr", Y=np.ascontiguousarray(light[..., 0]), A=np.full(light.shape[:2], 0.5, "f4"))
    assert run("tonemap", "a.exr").code == 0
    picture, mode = png("a.png")
    assert mode == "LA"
    expected = shown(np.repeat(2 * light[..., :1], 3, axis=-1))[..., 0]  # alpha is premultiplied
    assert np.abs(picture[..., 0] - 255 * expected).max() < 1.01
