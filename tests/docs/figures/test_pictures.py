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

# Takes the parameters that the snakes' scenes have; a white sky all around.
SCENE = """<scene version="3.0.0">
  <default name="sun_azimuth" value="0"/><default name="light" value="it"/>
  <default name="resx" value="64"/><default name="resy" value="64"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <film type="hdrfilm">
      <integer name="width" value="$resx"/><integer name="height" value="$resy"/>
    </film>
  </sensor>
  <emitter type="constant"><spectrum name="radiance" value="1"/></emitter>
  <shape type="sphere" id="$light">
    <transform name="to_world"><rotate z="1" angle="$sun_azimuth"/></transform>
  </shape>
</scene>
"""


@pytest.fixture
def scenes(tmp_path):
    """A folder with stand-ins for the scenes of the two snakes."""
    folder = tmp_path / "scenes"
    folder.mkdir()
    for name in ("snake.xml", "xenopeltis.xml"):
        (folder / name).write_text(SCENE)
    return folder


def test_snakes_are_rendered_in_two_lights_each(scenes, tmp_path):
    written = pictures.render_snakes(tmp_path, scenes, spp=1, size=(24, 16))
    assert [path.name for path in written] == [
        "snake.jpg", "snake_other_light.jpg", "xenopeltis.jpg", "xenopeltis_other_light.jpg",
    ]  # fmt: skip
    for path in written:
        with Image.open(path) as image:
            assert image.format == "JPEG"
            assert image.size == (24, 16)


def test_only_what_is_asked_for_is_made_in_order(tmp_path, monkeypatch, capsys):
    made = []
    figures = {name: lambda _, name=name: made.append(name) for name in pictures.FIGURES}
    monkeypatch.setattr(pictures, "FIGURES", figures)
    assert pictures.main(["-o", str(tmp_path)]) == 0
    assert made == ["patches", "maps", "snakes"]
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()] == made
    made.clear()
    assert pictures.main(["-o", str(tmp_path), "--only", "maps"]) == 0
    assert made == ["maps"]


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
