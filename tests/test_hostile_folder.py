"""A folder from somebody else: nothing there runs, and no file beside it is read or quoted."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import groupby, product
from pathlib import Path

import pytest

from mitsuba_diffraction.cli import build_parser
from mitsuba_diffraction.plugin import installed
from tests.support import ROOT
from tests.support.hostile import PRIVATE, SCENES, Folder, hostile_folder, run_in

pytestmark = pytest.mark.thorough

_HEIGHTS = ["heights.npy", "--pixel-size", "0.08", "--coherence-width", "4"]
_TABLE = [*_HEIGHTS, "--tolerance", "0.1"]
_METAL = ["--material", "Al"]
_RGB = ["-m", "scalar_rgb"]
#: Commands that do what they are asked for, whatever else lies in the folder.
DONE = [
    ["presets"],
    ["info", "heights.npy", "--pixel-size", "0.08"],
    ["precompute", *_TABLE, "-o", "out/table.exr"],
    ["render", "scene.xml", *_RGB, "-s", "1", "-o", "out/picture.exr"],
    ["tonemap", "out/picture.exr", "-o", "out/picture.png"],
    ["plan", "scene.xml", "-m", "llvm_ad_spectral", "--paths", "100", "-o", "out/plan.toml"],
    ["tangents", "mesh.ply", "-o", "out/mesh.ply", "--along", "x"],
    ["hologram", "logo.png", "-o", "out/hologram", "--dots", "16"],
    ["brdf-map", *_TABLE, *_METAL, "--resolution", "8", "--samples", "1", "-o", "out/map.png"],
    ["spectrum", *_TABLE, *_METAL, "--light", "30", "--detector", "0", "--step", "100", "-o",
     "out/spectrum.csv"],
    ["evaluate", *_TABLE, "--coherence-width", "12", "--periodic", "exact", *_METAL, "--step", "40",
     "--angle-step", "0.5", "--positions", "0", "-o", "out/bands.png"],
    ["sweep", "coherence-width", *_HEIGHTS[:3], "--values", "4", "--resolution", "8", "--step",
     "100", "-o", "out/sweep.png"],
    ["survey", *_TABLE, "--resolution", "8", "-o", "out/survey"],
    ["scatter", *_HEIGHTS, "-o", "out/scatter.csv"],
    ["solve", "sinusoidal", "--period", "0.6", "--depth", "0.03", "--material", "none", "--theta",
     "0", "--wavelength-range", "605:605", "--resolution", "48", "-o", "out/orders.nc"],
    ["orders", "out/orders.nc", "--theta", "0", "--wavelength", "605", "-o", "out/orders.csv"],
    ["export-shader", *_TABLE, *_METAL, "-o", "out/shader"],
    ["export-osl", *_TABLE, *_METAL, "-o", "out/osl"],
    ["export-bsdf", *_TABLE, *_METAL, "--format", "bird", "--wavelength", "550", "--theta", "0",
     "--phi", "0", "--resolution", "8", "-o", "out/a.json"],
    ["export-viewer", "scene.xml", "-o", "out/page.html", "-m", "llvm_ad_rgb", "--method", "exact"],
    ["export-osl", "--addon", "out/addon.zip", "--with", "out/osl"],
]  # fmt: skip
_OF_SCENES = {
    "plan": ["-o", "out/refused.toml"], "compare": ["-o", "out/refused"], "view": [],
    "export-viewer": ["-o", "out/refused.html"],
}  # fmt: skip
_SOME_SCENES = ["plugin.xml", "above.xml", "table.xml"]
#: Commands that are refused in one line; tests/cli/test_inputs.py names pipes to all of them.
REFUSED = [
    *(["render", f"{scene}.xml", "-o", "out/refused.exr"] for scene in SCENES),
    *([*words, *_OF_SCENES[words[0]]] for words in product(_OF_SCENES, _SOME_SCENES)),
    ["hologram", "postscript.png"],
    ["info", "postscript.png", "--pixel-size", "0.1", "--max-height", "0.1"],
    ["tangents", "mesh.gltf", "-o", "out/refused.ply"],
    ["info", "mesh.gltf"],
    ["export-osl", "--addon", "out/refused.zip", "--with", "exported"],
    ["brdf-map", *_TABLE, "--material", "../../id_rsa"],
    ["brdf-map", *_TABLE, "--material", "Unobtainium"],
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return hostile_folder(tmp_path_factory.mktemp("hostile"))


def test_every_command_is_tried():
    commands = next(a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    # its heights are read as those of all others are, and measuring them takes a minute
    assert {words[0] for words in DONE + REFUSED} == set(commands) - {"tradeoff"}


def test_commands_do_what_they_are_asked_for_and_nothing_else(folder):
    control = folder.path.parent / "control"
    control.write_text(PRIVATE)
    for file in (control, *folder.private):
        os.utime(file, (0, file.stat().st_mtime))
    control.read_text()
    notes_access = control.stat().st_atime > 0  # some file systems do not
    by_command = (list(group) for _, group in groupby(REFUSED, lambda words: words[0]))
    results = run_in(folder, [*([words] for words in DONE), *by_command])
    failed = [(words, ran) for words, ran in zip(DONE, results, strict=False) if ran.code != 0]
    assert failed == []
    wrong = []
    for words, ran in zip(REFUSED, results[len(DONE) :], strict=True):
        lines = [line for line in ran.err.splitlines() if " note on " not in line]
        if ran.code != 1 or ran.out or len(lines) != 1 or "unexpected" in ran.err:
            wrong.append((words, ran))
    assert wrong == []
    assert not folder.mark.exists()
    assert [ran for ran in results if PRIVATE in ran.out + ran.err] == []
    if notes_access:
        assert [file.name for file in folder.private if file.stat().st_atime > 0] == []


def test_python_imports_nothing_from_the_folder(folder):
    """As `python -m mitsuba_diffraction`, which has the current folder first in its path."""
    words = [sys.executable, "-m", "mitsuba_diffraction", "presets"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    ran = subprocess.run(words, cwd=folder.path, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert not folder.mark.exists()


_PROGRAM = """
import mitsuba_diffraction as md
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
print(mi.load_dict({"type": "uniform", "value": 0.5}))
for name in md.plugin.installed.REGISTERED:
    try:
        mi.load_dict({"type": name})
    except RuntimeError as error:
        assert "not found" not in str(error), error
print(mi.file_resolver().resolve("data/ior/Al.eta.spd"))
"""


def test_nothing_in_the_current_folder_runs_in_a_program(folder):
    """Mitsuba sets its search path once, when it is imported."""
    ran = subprocess.run(
        [sys.executable, "-P", "-c", _PROGRAM], cwd=folder.path, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    assert Path(ran.stdout.splitlines()[-1]).is_relative_to(installed.folder())
    assert not folder.mark.exists()
