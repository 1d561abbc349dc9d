"""Maps on disk: pictures and numbers are the same map, the right way up."""

from __future__ import annotations

import json

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction.analysis import maps
from mitsuba_diffraction.analysis.maps import LightDirection, brdf_map
from tests.support.mapped import centres, mirror

# Patches here are small and tiled, and the flat ones coarse: the warnings are right, but known.
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")


@pytest.mark.usefixtures("variant")
def test_an_exr_has_the_largest_y_on_top_and_says_what_it_is(tmp_path):
    light = LightDirection(50.0, 90.0)  # reflected towards -y
    result = brdf_map(mirror(), light.theta, light.phi, step=47, resolution=64, spectral=True)
    maps.save_exr(result, tmp_path / "a.exr", notes={"source": "here"})
    file = OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True)
    channels = file.channels()
    assert set("RGBA") <= set(channels)
    assert sum(name.startswith("T.") and name.endswith("nm") for name in channels) == 10
    assert "T.383,5nm" in channels
    np.testing.assert_array_equal(channels["G"].pixels[::-1], result.linear[..., 1])
    np.testing.assert_array_equal(channels["T.383,5nm"].pixels[::-1], result.spectrum[0])
    row = np.unravel_index(channels["G"].pixels.argmax(), (64, 64))[0]
    assert centres(64)[::-1][row] == pytest.approx(light.mirror[1], abs=0.02)
    document = json.loads(file.header()[maps.picture.ATTRIBUTE])
    assert document["theta"] == 50.0
    assert document["source"] == "here"
    assert document["unit"] == "1/sr"


@pytest.mark.usefixtures("variant")
def test_a_picture_shows_the_map_pixel_by_pixel(tmp_path):
    result = brdf_map(mirror(), 40.0, step=47, resolution=500)  # the marks are elsewhere
    maps.save_png(result, tmp_path / "a.png", exposure=-8.0, title="mirror", notes="R = 1")
    image = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(float)
    column = int(250 * (1 + LightDirection(40.0).mirror[0]))
    shown = np.rint(result.srgb(-8.0)[246:254, column - 4 : column + 4, :3] * 255)[::-1]
    assert np.ptp(shown) == 255  # the lobe, white on black
    windows = np.lib.stride_tricks.sliding_window_view(image, (8, 8, 3))[:, :, 0]
    differences = np.abs(windows - shown).max(axis=(2, 3, 4))
    assert differences.min() <= 2  # rounding, of 255: somewhere it is, pixel by pixel
