"""`hologram`: from a logo to a folder with textures and a scene."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from PIL import Image

from mitsuba_diffraction.scene.parameters import check_parameters, files_of
from tests.support.logos import drawn, write_board


@pytest.fixture
def logo(here):
    drawn(64, 4).save("logo.png")
    return "logo.png"


def test_a_card_is_a_folder_that_needs_no_other_file(run, logo):
    assert run("hologram", logo, "--dots", "64", "--json", "a.json").code == 0
    scene = Path("logo_hologram/label.xml")
    assert json.loads(Path("a.json").read_text())["scene"] == str(scene)
    folder = scene.parent.resolve()
    assert {file.resolve().parent for file in files_of(scene)} == {folder}
    assert {file.name for file in files_of(scene)} == set(os.listdir(folder))
    check_parameters(scene, {"camera_azimuth": "0", "ring_radius": "1", "light": "ring.xml"})


def test_a_label_lies_on_the_front_of_a_mesh(run, logo):
    write_board(Path("board.obj"))
    ran = run("hologram", logo, "--mesh", "board.obj", "--up", "z", "-o", "a/b")
    assert ran.code == 0, ran.err
    assert 'type="fitted_mesh"' in Path("a/b/label.xml").read_text()
    assert Path("a/b/board.obj").read_bytes() == Path("board.obj").read_bytes()


def test_bad_input_is_one_line(run, logo):
    Image.new("RGB", (9, 9), "red").save("red.png")
    assert "no colour beside its ground" in run("hologram", "red.png").failed_in_one_line()
    assert "'none.png' does not exist" in run("hologram", "none.png").failed_in_one_line()
    Path("flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    line = run("hologram", logo, "--mesh", "flat.obj").failed_in_one_line()
    assert "flat" in line
    write_board(Path("bare.obj"), with_uv=False)
    line = run("hologram", logo, "--mesh", "bare.obj").failed_in_one_line()
    assert "no texture coordinates" in line
    assert sorted(os.listdir()) == ["bare.obj", "flat.obj", "logo.png", "red.png"]
