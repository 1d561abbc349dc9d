"""`export-osl` from the outside."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction import OrderTable
from mitsuba_diffraction.cli import main


@pytest.fixture
def source(tmp_path: Path) -> Path:
    file = tmp_path / "my grating.nc"
    OrderTable.mirror(1.6).save(file)
    return file


def test_shader_and_all_that_it_reads_are_written(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], some_variant: str
) -> None:
    out, report = tmp_path / "blender" / "grating", tmp_path / "report.json"
    command = ["export-osl", str(source), "-o", str(out), "--orientation", "90", "--json",
               str(report)]  # fmt: skip
    assert main(command) == 0
    shader = out / "diffraction_my_grating.osl"
    assert capsys.readouterr().out.startswith(f"{shader}: ")
    document = json.loads(shader.with_suffix(".json").read_text(encoding="utf-8"))
    rotation = next(item for item in document["inputs"] if item["identifier"] == "Rotation")
    assert rotation["default"] == 90.0
    for file in document["textures"].values():
        pixels = OpenEXR.File(str(out / file)).channels()["RGBA"].pixels
        assert np.isfinite(pixels).all()
    assert (out / "blender_material.py").exists()
    assert json.loads(report.read_text(encoding="utf-8"))["error"]["mean"] == 0.0


def test_a_bad_name_is_refused_before_anything_is_made(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "grating"
    for name in ("a b", "while", "mix"):
        assert main(["export-osl", str(source), "-o", str(out), "--name", name]) == 1
        assert "name=" in capsys.readouterr().err
    assert not out.exists()


def test_an_addon_holds_the_folders_that_are_named(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], some_variant: str
) -> None:
    out, file = tmp_path / "grating-osl", tmp_path / "looks.zip"
    assert main(["export-osl", str(source), "-o", str(out)]) == 0
    assert main(["export-osl", "--addon", str(file), "--with", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith(f"{file}: grating: ")
    assert main(["export-osl", str(source), "--addon", str(file)]) == 2
    assert main(["export-osl", "--addon", str(file), "--with", str(tmp_path)]) == 1
    assert "export-osl" in capsys.readouterr().err.splitlines()[-1]
