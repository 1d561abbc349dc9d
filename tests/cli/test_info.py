"""`info`: what is in a file, for people and as JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionTable, HeightField
from tests.support.meshes import ply_text


@pytest.fixture
def table(heights, tmp_path):
    field = HeightField.load(heights, pixel_size=0.08)
    file = tmp_path / "table.exr"
    DiffractionTable.build(field, coherence_width=6.0).save(file)
    return file


def test_warnings_name_the_options_of_the_command(run, heights, here):
    np.save("tilted.npy", np.load(heights) + 0.003 * np.arange(75))
    ran = run("info", "tilted.npy", "--pixel-size", "0.08", "--level", "none").succeeded()
    assert "tilted.npy: use --level plane: " in ran.out


def test_pixels_and_extent_are_along_x_and_y(run, here):
    np.save(here / "wide.npy", np.eye(10, 40))
    out = run("info", "wide.npy", "--pixel-size", "0.1").out
    lines = dict(line.split(":", 1) for line in out.splitlines() if ":" in line)
    assert lines["pixels"].strip() == "40 x 10"
    assert lines["extent"].strip() == "4 x 1 µm"


def test_json_has_the_numbers(run, heights):
    data = json.loads(run("info", heights, "--pixel-size", "0.08", "--json").out)
    assert data["kind"] == "height field"
    assert data["shape"] == [75, 75]
    assert data["extent"] == pytest.approx([6.0, 6.0])
    # a sine's amplitude over √2, over two whole periods
    assert data["rms_height"] == pytest.approx(0.02 / np.sqrt(2), rel=1e-6)
    assert data["warnings"] == []
    # of light of 550 nm: sin θ = 0.55/6
    assert data["window"] == (
        "65 µm for the mirror direction, 6 µm for orders: windows of 6 µm know nothing of light "
        "within 5.3° of the mirror but the mirror"
    )


def test_treatments_are_listed(run, heights):
    options = ("--pixel-size", "0.08", "--level", "plane", "--periodic", "exact", "--json")
    history = json.loads(run("info", heights, *options).out)["history"]
    assert len(history) == 2


def test_a_table_is_described_with_its_measured_error(run, table):
    data = json.loads(run("info", table, "--json").out)
    assert data["kind"] == "table"
    assert max(data["measured_error"].values()) <= data["tolerance"]
    assert data["source"]["name"] == "grating.npy"
    assert "measured error" in run("info", table).out


def test_a_recipe_is_described(run, heights):
    recipe = heights.with_name("a.toml")
    recipe.write_text('source = "grating.npy"\npixel_size = 0.08\ntolerance = 1e-4\n')
    data = json.loads(run("info", recipe, "--json").out)
    assert data["kind"] == "recipe"
    assert data["table"] == {"tolerance": 1e-4}
    assert data["output exists"] is False
    assert data["patches"][0]["shape"] == [75, 75]


def test_a_damaged_table_is_one_line(run, table, capfd):
    content = table.read_bytes()
    for damaged in (content[:-1000], content[:-100] + bytes(100), content[:-1000] + bytes(1000)):
        table.write_bytes(damaged)
        assert f"'{table}'" in run("info", table).failed_in_one_line()
        # OpenEXR prints past Python, some of it to stdout
        assert capfd.readouterr() == ("", "")


def test_an_exr_that_is_no_table_is_heights(run, tmp_path):
    import OpenEXR

    file = tmp_path / "heights.exr"
    OpenEXR.File({}, {"Y": np.zeros((4, 4), np.float32)}).write(str(file))
    assert "height field" in run("info", file, "--pixel-size", "1").out


@pytest.mark.parametrize("own", [True, False], ids=["normals", "none"])
@pytest.mark.parametrize("has_uv", [True, False])
def test_a_mesh_is_judged_by_its_tangents_and_normals(run, tmp_path, has_uv, own):
    file = tmp_path / "quad.ply"
    names = ["x", "y", "z", *(["nx", "ny", "nz"] * own), *(["u", "v"] * has_uv)]
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    rows = [(*uv, 0, *((0, 0, 1) * own), *(uv * has_uv)) for uv in square]
    file.write_text(ply_text(rows, [(0, 1, 2), (0, 2, 3)], names))
    data = json.loads(run("info", file, "--json").out)
    assert data["kind"] == "mesh"
    assert data["triangles"] == 2
    assert data["usable"] is has_uv
    assert (data["normals"] == "in the file") is own


@pytest.mark.parametrize("own", [True, False])
def test_normals_of_an_obj_are_those_of_the_file(run, tmp_path, own):
    normals = "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n" if own else "f 1/1 2/2 3/3\n"
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    (tmp_path / "mesh.obj").write_text(text + normals, encoding="ascii")
    data = json.loads(run("info", tmp_path / "mesh.obj", "--json").out)
    assert (data["normals"] == "in the file") is own


def test_the_albedo_is_plotted(run, table, tmp_path):
    picture = tmp_path / "albedo.png"
    ran = run("info", table, "--albedo", picture).succeeded()
    assert str(picture) in ran.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("depth", [1.0, 0.0], ids=["rough", "flat"])
def test_heights_are_drawn(run, heights, tmp_path, depth):
    np.save(heights, depth * np.load(heights))
    picture = tmp_path / "heights.png"
    ran = run("info", heights, "--pixel-size", "0.08", "--picture", picture).succeeded()
    assert f"picture: {picture}" in " ".join(ran.out.split())
    with Image.open(picture) as image:
        assert image.width > 3 * image.height  # a row of panels


def test_a_patch_too_wide_for_its_window_is_mentioned(run, tmp_path):
    np.save(tmp_path / "wide.npy", np.random.default_rng(1).random((8, 600)) * 0.01)
    asked = ("--pixel-size", "10", "--periodic", "exact", "--json")
    data = json.loads(run("info", tmp_path / "wide.npy", *asked).out)
    assert any("so much more than the coherence window" in line for line in data["warnings"])


def test_a_question_about_units_is_asked_once(run, here):
    np.save("nm.npy", np.tile(100.0 * np.sin(np.arange(64)), (64, 1)))
    ran = run("info", "nm.npy", "--pixel-size", 0.05)
    assert ran.out.count("in nm? Then divide") == 1
    assert "cannot build the table" in ran.out


def test_formats_are_listed_with_what_to_export_for_others(run):
    ran = run("info", "--formats").succeeded()
    assert "NanoScope (.spm" in ran.out
    data = json.loads(run("info", "--formats", "--json").out)
    for row in data["not read"]:
        assert row["instead"]
