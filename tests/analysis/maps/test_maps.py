"""BRDF maps: pixels of the hemisphere, bands, exposure, files, and what is refused."""

from __future__ import annotations

import json

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.analysis import maps
from mitsuba_diffraction.analysis.maps import Bands, LightDirection, brdf_map, hemisphere
from tests.analysis.maps.mapped import GRATING, centres, mirror, plugin


@given(st.integers(1, 200))
def test_sub_samples_take_every_place_once_in_each_direction(samples):
    pattern = hemisphere.sub_samples(samples)
    places = (np.arange(samples) + 0.5) / samples
    for column in pattern.T:
        np.testing.assert_array_equal(np.sort(column), places)
    assert len(np.unique(pattern[:, :2], axis=0)) == samples


@given(st.floats(0.1, 500), st.floats(300, 500), st.floats(0.1, 500))
def test_bands_fill_the_range_and_are_no_wider_than_the_step(step, low, extent):
    extent = (low + extent) - low  # as rounding leaves it
    if step > extent:
        with pytest.raises(DiffractionError, match="step="):
            Bands(low, low + extent, step)
        return
    bands = Bands(low, low + max(extent, 1.000001 * step), step)
    assert bands.width <= step * (1 + 1e-9)
    np.testing.assert_allclose(bands.wavelengths(0.0)[0], low)
    np.testing.assert_allclose(bands.wavelengths(1.0)[-1], bands.high)


def test_five_nanometres_are_ninety_four_bands():
    assert Bands(360, 830).count == 94
    assert Bands(380, 380.3, 0.1).count == 3  # not one more: 0.3/0.1 is above 3 in floats


@pytest.mark.usefixtures("variant")
def test_exposure_shows_what_lies_around_the_mirror_direction():
    result = brdf_map(plugin(GRATING, coherence_width=20.0), 20.0, step=47, resolution=128)
    stops = result.exposure()
    shown = np.sort((result.luminance * 2.0**stops)[result.away_from_mirror()].astype(float))
    below_white = shown[shown < 1.0].sum() / shown.sum()
    assert below_white >= 0.45  # rounded to a tenth of a stop
    assert (result.luminance * 2.0**stops > 8.6).mean() <= 1e-3
    alone = brdf_map(mirror(), 20.0, step=47, resolution=64)  # nothing but the lobe: it counts
    assert alone.luminance.max() * 2.0 ** alone.exposure() > 1.0
    dark = brdf_map(mi.load_dict({"type": "dielectric"}), resolution=8)  # specular only
    assert dark.exposure() == 0.0


@pytest.mark.usefixtures("variant")
def test_a_single_wavelength_has_no_colours():
    result = brdf_map(mirror(), wavelength=550.0, resolution=16)
    assert result.xyz is None
    assert result.albedo().shape == (1,)
    with pytest.raises(ValueError, match="no colours"):
        _ = result.linear


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
    image = np.moveaxis(np.asarray(Image.open(tmp_path / "a.png").convert("RGB"), np.int16), -1, 0)
    column = int(250 * (1 + LightDirection(40.0).mirror[0]))
    shown = np.rint(result.srgb(-8.0)[246:254, column - 4 : column + 4, :3] * 255)[::-1]
    assert np.ptp(shown) == 255  # the lobe, white on black
    height, width = image.shape[1] - 7, image.shape[2] - 7
    here = np.ones((height, width), bool)
    for y, x, channel in np.ndindex(8, 8, 3):
        there = image[channel, y : y + height, x : x + width]
        here &= np.abs(there - int(shown[y, x, channel])) <= 2  # rounding, of 255
    assert here.any()  # somewhere it is, pixel by pixel


@pytest.mark.usefixtures("variant")
def test_dark_directions_of_one_wavelength_are_dark_not_missing():
    from matplotlib.figure import Figure

    result = brdf_map(mirror(), 0.0, wavelength=550.0, resolution=32)
    assert (result.luminance[hemisphere.inside(32)] == 0.0).any()
    shown = maps.draw(Figure().subplots(), result).get_array()
    np.testing.assert_array_equal(np.ma.getmaskarray(shown), ~hemisphere.inside(32))
