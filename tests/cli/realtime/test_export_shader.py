"""`export-shader` from the outside."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction.cli import main

GRATING = 'generator = "sinusoidal"\n[arguments]\nperiod = 1.6\ndepth = 0.06\nperiods = 3\n'


@pytest.fixture
def source(tmp_path: Path) -> Path:
    file = tmp_path / "grating.toml"
    file.write_text(GRATING)
    return file


def test_a_shader_is_written_with_all_that_it_reads(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], some_variant: str
) -> None:
    out = tmp_path / "shaders" / "grating"
    report = tmp_path / "report.json"
    command = ["export-shader", str(source), "-o", str(out), "--method", "fast", "--int-ior", "1.5",
               "--coherence-width", "4", "--json", str(report)]  # fmt: skip
    assert main(command) == 0
    assert f"{out}: diffraction: " in capsys.readouterr().out
    constants = json.loads((out / "constants.json").read_text(encoding="utf-8"))
    code = (out / "diffraction.glsl").read_text(encoding="utf-8")
    assert constants["functions"] == {"fast": "diffraction"}
    assert "exact" not in code.partition("#define")[2]
    assert constants["uniforms"]["md_eta"] == pytest.approx(1.5, abs=1e-3)
    assert len(constants["textures"]) == len(list(out.glob("*.exr")))
    for name, entry in constants["textures"].items():
        assert f"uniform sampler2D {name};" in code
        pixels = OpenEXR.File(str(out / entry["file"])).channels()["RGBA"].pixels
        assert pixels.shape == (entry["height"], entry["width"], 4)
        assert pixels.dtype == {"half": np.float16, "float": np.float32}[entry["type"]]
        assert np.isfinite(pixels).all()
    assert json.loads(report.read_text(encoding="utf-8"))["bytes"]["code"] == len(code.encode())
    assert {file.name for file in out.iterdir()} >= {"diffraction.js", "example.html"}
