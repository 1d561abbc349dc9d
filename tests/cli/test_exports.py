"""Commands that write folders and pages: `export-*`, `view` and `hologram`."""

from __future__ import annotations

import json
import os
import webbrowser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction import OrderTable
from mitsuba_diffraction.scene.parameters import files_of, scene_values
from tests.support.coarse import little_light
from tests.support.logos import drawn, write_board
from tests.support.room import plate_file

pytestmark = pytest.mark.usefixtures("some_variant")


@pytest.fixture
def plate(here: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scene with little light between surfaces, of which a plate alone has none."""
    little_light(monkeypatch.setattr)
    return plate_file(here)


@pytest.fixture
def orders(here: Path) -> str:
    """A table of orders."""
    OrderTable.mirror(1.6).save(here / "my grating.nc")
    return "my grating.nc"


def pixels(file: Path) -> np.ndarray:
    return np.asarray(OpenEXR.File(str(file)).channels()["RGBA"].pixels)


def test_a_shader_is_written_with_all_that_it_reads(run, plate):
    out = Path("shaders/grating")
    ran = run("export-shader", "grating.toml", "-o", out, "--method", "fast", "--int-ior", "1.5",
              "--coherence-width", "4", "--json", "report.json").succeeded()  # fmt: skip
    assert f"{out}: diffraction: " in ran.out
    constants = json.loads((out / "constants.json").read_text(encoding="utf-8"))
    code = (out / "diffraction.glsl").read_text(encoding="utf-8")
    assert constants["functions"] == {"fast": "diffraction"}
    assert "exact" not in code.partition("#define")[2]
    assert constants["uniforms"]["md_eta"] == pytest.approx(1.5, abs=1e-3)
    assert len(constants["textures"]) == len(list(out.glob("*.exr")))
    for name, entry in constants["textures"].items():
        assert f"uniform sampler2D {name};" in code
        texels = pixels(out / entry["file"])
        assert texels.shape == (entry["height"], entry["width"], 4)
        assert texels.dtype == {"half": np.float16, "float": np.float32}[entry["type"]]
        assert np.isfinite(texels).all()
    report = json.loads(Path("report.json").read_text(encoding="utf-8"))
    assert report["bytes"]["code"] == len(code.encode())
    assert {file.name for file in out.iterdir()} >= {"diffraction.js", "example.html"}


def test_a_material_for_blender_is_written_with_all_that_it_reads(run, orders):
    out = Path("blender/grating")
    ran = run(
        "export-osl", orders, "-o", out, "--orientation", "90", "--json", "report.json"
    ).succeeded()
    shader = out / "diffraction_my_grating.osl"
    assert ran.out.startswith(f"{shader}: ")
    document = json.loads(shader.with_suffix(".json").read_text(encoding="utf-8"))
    rotation = next(item for item in document["inputs"] if item["identifier"] == "Rotation")
    assert rotation["default"] == 90.0
    for file in document["textures"].values():
        assert np.isfinite(pixels(out / file)).all()
    assert (out / "blender_material.py").exists()
    assert json.loads(Path("report.json").read_text(encoding="utf-8"))["error"]["mean"] == 0.0


def test_an_addon_holds_the_folders_that_are_named(run, orders):
    assert run("export-osl", orders, "-o", "grating-osl").code == 0
    ran = run("export-osl", "--addon", "looks.zip", "--with", "grating-osl").succeeded()
    assert ran.out.startswith("looks.zip: grating: ")


def test_a_page_is_written_with_its_title_as_text_and_its_loss_is_named(run, plate):
    plate.rename("<!--<script>.xml")
    ran = run("export-viewer", "<!--<script>.xml", "-o", "plate.html", "--method", "fast",
              "--json", "page.json").succeeded()  # fmt: skip
    page = Path("plate.html")
    report = json.loads(Path("page.json").read_text(encoding="utf-8"))
    assert report["bytes"] == page.stat().st_size
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert "http://" not in text
    assert "https://" not in text
    assert "<!--<script" not in text
    assert r"\u003c!--\u003cscript>" in text
    assert "plate.html: " in ran.out
    assert "fast ΔE2000" in ran.out
    assert "exact" not in ran.out


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that are opened, in place of a browser with windows."""
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: not addresses.append(address))
    monkeypatch.setenv("BROWSER", "some")
    return addresses


def test_the_page_is_opened_with_its_start(run, plate, opened):
    out = plate.with_name("a plate.html")
    start = ["--method", "exact", "--exposure", "1.5"]
    assert run("view", plate, "-o", out, *start).code == 0
    assert out.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    (address,) = opened
    assert Path(unquote(urlsplit(address).path)) == out
    assert urlsplit(address).fragment == "method=exact&exposure=1.5"


def test_without_a_browser_the_address_is_said(run, plate, opened, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr("tempfile.tempdir", str(plate.parent))
    ran = run("view", plate, "--method", "exact").succeeded()
    (page,) = plate.parent.glob("mitsuba-diffraction-*/plate.html")
    assert page.as_uri() in ran.out
    assert opened == []


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
    scene_values(scene, {"camera_azimuth": "0", "ring_radius": "1", "light": "ring.xml"})


def test_a_label_lies_on_the_front_of_a_mesh(run, logo):
    write_board(Path("board.obj"))
    run("hologram", logo, "--mesh", "board.obj", "--up", "z", "-o", "a/b").succeeded()
    assert 'type="fitted_mesh"' in Path("a/b/label.xml").read_text()
    assert Path("a/b/board.obj").read_bytes() == Path("board.obj").read_bytes()
