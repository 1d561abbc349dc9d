"""The gallery: its commands are ones that work."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from docs.make.figures import gallery
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.scene.parameters import parameters_of
from tests.support import ROOT
from tests.support.pages import PAGES

DOCS = ROOT / "docs"

# Half white, half black.
SCENE = """<scene version="3.0.0">
  <default name="light" value="1"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <film type="hdrfilm">
      <integer name="width" value="24"/><integer name="height" value="16"/>
    </film>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="$light"/></emitter>
</scene>
"""


PICTURES = [
    picture for page in gallery.PAGES for picture in gallery.pictures(PAGES[f"docs/{page}"])
]
pictures = pytest.mark.parametrize("picture", PICTURES, ids=lambda p: p.file.stem)


@pictures
def test_its_commands_turn_what_the_scene_has(picture):
    program, *words = picture.commands[-1]
    assert program.endswith("mitsuba-diffraction")
    args = build_parser().parse_args(words)
    known = parameters_of(ROOT / args.scene)
    assert known is not None
    assert {name for name, _ in args.parameters} | set(args.turn) <= set(known)


@pictures
def test_pictures_are_there_and_small(picture):
    file = DOCS / picture.file
    assert 2_000 < file.stat().st_size <= 250_000
    with Image.open(file) as image:
        assert min(image.size) >= 150


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """A folder with a scene, and what its page shows with some words behind `render`."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/room.xml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)

    def picture(command):
        text = f"![](images/gallery/room.jpg)\n\nA room.\n\n```sh\n{command}\n```\n\n## Next\n"
        (found,) = gallery.pictures(text)
        return found

    return picture


def test_a_picture_is_made_by_its_commands(stand_in, tmp_path, capsys):
    made = stand_in(
        "mitsuba-diffraction render scenes/room.xml -m scalar_rgb -D light=0.2 \\\n"
        "    -s 1 -o out/room.png"
    )
    gallery.make(made, tmp_path / "room.jpg")
    with Image.open(tmp_path / "room.jpg") as image:
        assert image.size == (24, 16)
        assert np.asarray(image).mean() == pytest.approx(124, abs=2)  # 0.2 in sRGB bytes
    assert capsys.readouterr().out == ""


def test_a_command_that_fails_is_named(stand_in, tmp_path):
    made = stand_in("mitsuba-diffraction render scenes/none.xml -o out/a.png")
    with pytest.raises(DiffractionError, match=r"'render scenes/none.xml .*' failed"):
        gallery.make(made, tmp_path / "a.jpg")
