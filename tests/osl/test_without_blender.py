"""blender_material.py in a Python without Blender, or in a Blender that lacks OSL: one line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import mitsuba_diffraction

SCRIPT = Path(mitsuba_diffraction.__file__).parent / "osl" / "blender_material.py"
_BPY = """
class app:
    version, version_string, background = {version}, "{text}", True
"""


def ran(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONIOENCODING": "utf-8"}
    return subprocess.run(
        [sys.executable, "-S", str(SCRIPT), *words],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("version", "with_osl", "said"),
    [((5, 0, 1), False, "without Open Shading Language"), ((3, 6, 0), True, "too old")],
)
def test_blender_that_cannot_show_it_is_one_line(tmp_path, version, with_osl, said):
    text = ".".join(map(str, version))
    (tmp_path / "bpy.py").write_text(_BPY.format(version=version, text=text))
    (tmp_path / "mathutils.py").touch()
    (tmp_path / "_cycles.py").write_text(f"with_osl = {with_osl}\n")
    done = ran(tmp_path)
    assert done.returncode == 1
    assert said in done.stderr
    assert text in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_python_without_blender_is_one_line(tmp_path):
    done = ran(tmp_path)
    assert done.returncode == 1
    assert "no module bpy" in done.stderr
    assert len(done.stderr.splitlines()) == 1
