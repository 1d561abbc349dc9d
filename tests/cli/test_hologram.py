"""`hologram`: from a logo to a folder with textures and a scene."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

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
