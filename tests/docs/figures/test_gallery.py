"""The gallery: its commands are ones that work."""

from __future__ import annotations

import shlex

import numpy as np
import pytest
from PIL import Image

from docs.make.figures import gallery
from docs.make.figures.pages import write_jpeg
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.scene.parameters import parameters_of
from scenes.make.__main__ import build_parser as meshes_parser
from tests.support import ROOT

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


@pytest.mark.parametrize("picture", gallery.PICTURES, ids=lambda p: p.name)
def test_its_commands_fit_the_program_and_the_scene(picture):
    for command in picture.commands:
        words = shlex.split(command)
        if words[0] == "meshes":
            meshes_parser().parse_args(words[1:])
            continue
        args = build_parser().parse_args(words)
        if words[0] == "render":
            known = parameters_of(ROOT / args.scene)
            assert known is not None
            assert {name for name, _ in args.parameters} <= set(known)
            assert set(args.turn) <= set(known)


def test_every_scene_is_shown():
    shown = {shlex.split(p.commands[-1])[1] for p in gallery.PICTURES if p.page == "gallery"}
    # for the others to include, and one that needs no picture: docs/meshes.md works with it
    parts = {"from_blender", "daylight", "lamp", "room", "skin", "skin_two", "studio", "window"}
    parts |= {"environment", "outdoors", "label", "ring"}
    scenes = {path.stem for path in (ROOT / "scenes").glob("*.xml")} - parts
    assert shown == {f"scenes/{name}.xml" for name in scenes}


@pytest.mark.parametrize("picture", gallery.PICTURES, ids=lambda p: p.name)
def test_pictures_are_there_and_small(picture):
    file = DOCS / picture.file
    assert 2_000 < file.stat().st_size <= 250_000
    with Image.open(file) as image:
        assert min(image.size) >= 150


@pytest.fixture
def stand_in(tmp_path):
    """A folder with a scene, and a picture of it."""
    (tmp_path / "room.xml").write_text(SCENE)

    def picture(*commands):
        return gallery.Picture("page", "room", "Room", "A room.", commands)

    return tmp_path, picture


def test_a_picture_is_made_by_its_commands(stand_in, capsys):
    folder, picture = stand_in
    made = picture("render scenes/room.xml -m scalar_rgb -D light=0.2 -s 1 -o out/room.png")
    gallery.make(made, folder / "room.jpg", folder)
    with Image.open(folder / "room.jpg") as image:
        assert image.size == (24, 16)
        assert np.asarray(image).mean() == pytest.approx(124, abs=2)  # 0.2 in sRGB bytes
    assert capsys.readouterr().out == ""


def test_a_command_that_fails_is_named(stand_in):
    folder, picture = stand_in
    with pytest.raises(DiffractionError, match=r"room: 'render scenes/none.xml .*' failed"):
        gallery.make(picture("render scenes/none.xml -o out/a.png"), folder / "a.jpg", folder)


def test_quality_gives_way_to_size(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (80, 100, 3), np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.png")
    write_jpeg(tmp_path / "noise.png", tmp_path / "best.jpg")
    best = (tmp_path / "best.jpg").stat().st_size
    write_jpeg(tmp_path / "noise.png", tmp_path / "small.jpg", most=best * 3 // 4)
    assert (tmp_path / "small.jpg").stat().st_size <= best * 3 // 4
    with pytest.raises(DiffractionError, match="more than 100"):
        write_jpeg(tmp_path / "noise.png", tmp_path / "none.jpg", most=100)
    assert not (tmp_path / "none.jpg").exists()
    write_jpeg(tmp_path / "noise.png", tmp_path / "wide.jpg", width=50)
    with Image.open(tmp_path / "wide.jpg") as image:
        assert image.size == (50, 40)
