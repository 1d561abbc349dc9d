"""The pictures of the documentation are drawn, and bad input to their program is one line."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from docs.make.figures import pictures
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import LightDirection
from mitsuba_diffraction.analysis.pictures import colour_field, patches_figure
from mitsuba_diffraction.heights.gratings import cd, elaphe_like

pytestmark = pytest.mark.thorough


@pytest.mark.usefixtures("variant")
def test_there_is_a_map_for_each_patch_and_light():
    x = np.arange(32) * 0.0625
    fields = [
        HeightField(np.tile(0.02 * np.sin(2 * np.pi * m * x / 2.0), (32, 1)), 0.0625, name=f"{m}")
        for m in (1, 2)
    ]
    lights = (LightDirection(0.0), LightDirection(30.0), LightDirection(60.0))
    figure = pictures.maps_figure(fields, lights, resolution=16, step=100)
    assert len(figure.axes) == 6
    titles = [axes.get_title() for axes in figure.axes]
    assert [t.split(";")[0] for t in titles[:3]] == [f"1, {light}" for light in lights]
    assert all(t.endswith(" stops") for t in titles)
    for axes in figure.axes:
        (image,) = axes.get_images()
        assert np.asarray(image.get_array())[..., :3].max() > 0.5  # exposed so that it shows


def test_a_row_of_panels_with_units_for_each_patch():
    fields = [elaphe_like(20.0, 128), cd(20.0, 128)]
    figure = patches_figure(fields)
    panels = [axes for axes in figure.axes if axes.get_xlabel()]
    assert len(panels) == 10
    for axes in panels:
        labels = axes.get_xlabel() + axes.get_ylabel()
        assert "(" in labels or "sinθ" in labels


def test_colours_lie_where_the_grating_throws_them():
    """A CD's first orders, 650 nm/1.6 µm and so on, along v."""
    colours = colour_field(cd(32.0, 320, irregularity=0), 201)
    for channel, wavelength in enumerate((0.65, 0.55, 0.45)):
        for order in (-2, -1, 1, 2):
            v = round(100 + 100 * order * wavelength / 1.6)  # a pixel is 0.01, an order 0.02 wide
            between = round(100 + 100 * (order - 0.5) * wavelength / 1.6)
            assert colours[v, 100, channel] > colours[between, 100, channel] + 0.1


def test_program_writes_the_figure(tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "LOOKALIKES", (lambda: elaphe_like(16.0, 96),))
    assert pictures.main(["-o", str(tmp_path), "--only", "patches"]) == 0
    with Image.open(tmp_path / "patches.png") as image:
        assert image.size[0] > 1000
