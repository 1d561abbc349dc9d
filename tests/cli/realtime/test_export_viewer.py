"""`export-viewer` from the outside."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from mitsuba_diffraction.cli import main
from tests.support.plate import plate_file


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return plate_file(tmp_path)


def test_a_page_is_written_and_its_loss_is_named(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], some_variant: str
) -> None:
    out = tmp_path / "plate.html"
    report = tmp_path / "page.json"
    command = [
        "export-viewer",
        str(scene),
        "-o",
        str(out),
        "--method",
        "fast",
        "--json",
        str(report),
    ]
    assert main(command) == 0
    assert json.loads(report.read_text(encoding="utf-8"))["bytes"] == out.stat().st_size
    text = out.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert "http://" not in text
    assert "https://" not in text
    said = capsys.readouterr().out
    assert f"{out}: " in said
    assert "fast ΔE2000" in said
    assert "exact" not in said


def test_a_title_is_text_in_the_page(scene: Path, tmp_path: Path, some_variant: str) -> None:
    named = scene.rename(tmp_path / "<!--<script>.xml")
    out = tmp_path / "plate.html"
    assert main(["export-viewer", str(named), "-o", str(out), "--method", "fast"]) == 0
    text = out.read_text(encoding="utf-8")
    assert "<!--<script" not in text
    assert r"\u003c!--\u003cscript>" in text


@pytest.mark.parametrize("name", ["missing.exr", "empty.exr"])
def test_an_environment_without_a_picture_is_refused_in_one_line(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, some_variant: str
) -> None:
    (tmp_path / "empty.exr").touch()
    sky = f'<emitter type="envmap"><string name="filename" value="{name}"/></emitter></scene>'
    scene.write_text(scene.read_text().replace("</scene>", sky))
    out = tmp_path / "plate.html"
    assert main(["export-viewer", str(scene), "-o", str(out)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert name in line
    assert not out.exists()
