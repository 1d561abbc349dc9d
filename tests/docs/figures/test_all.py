"""`python -m docs.make.figures`: all pictures of the documentation."""

from __future__ import annotations

import os

import pytest
from PIL import Image

from docs.make.figures import __main__ as program
from docs.make.figures import snakes

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
    written = snakes.render_snakes(tmp_path, scenes, spp=1, size=(24, 16))
    assert [path.name for path in written] == [
        "snake.jpg", "snake_other_light.jpg", "xenopeltis.jpg", "xenopeltis_other_light.jpg",
    ]  # fmt: skip
    for path in written:
        with Image.open(path) as image:
            assert image.format == "JPEG"
            assert image.size == (24, 16)


def test_missing_scenes_are_one_line(tmp_path, capsys):
    assert program.main(["-o", str(tmp_path / "out"), "--only", "snakes", "--scenes", "no"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("snakes: error: 'no/snake.xml' does not exist")
    assert os.listdir(tmp_path / "out") == []


def test_only_what_is_asked_for_is_made_in_order(tmp_path, monkeypatch, capsys):
    made = []
    figures = {name: lambda _, name=name: made.append(name) or 0 for name in program.FIGURES}
    monkeypatch.setattr(program, "FIGURES", figures)
    assert program.main(["-o", str(tmp_path)]) == 0
    assert made == ["patches", "maps", "snakes"]
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()] == made
    made.clear()
    assert program.main(["-o", str(tmp_path), "--only", "maps"]) == 0
    assert made == ["maps"]


def test_a_failure_ends_it(tmp_path, monkeypatch):
    monkeypatch.setattr(program, "FIGURES", {"patches": lambda _: 1, "maps": lambda _: 1 / 0})
    assert program.main(["-o", str(tmp_path)]) == 1
