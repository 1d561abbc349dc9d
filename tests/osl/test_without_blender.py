"""blender_material.py without Blender: refusals in one line, and the materials that it rebuilds.

A folder's own materials of a .blend file are rebuilt, and other folders' materials stay.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import mitsuba_diffraction
from mitsuba_diffraction.osl.blender_material import own_data

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


class Blocks:
    """Data blocks as Blender has them: unique names, custom properties."""

    def __init__(self) -> None:
        self.blocks: list[Any] = []

    def __iter__(self) -> Iterator[Any]:
        return iter(self.blocks)

    def new(self, name: str) -> Any:
        self.blocks.append({"shown": name if not self.blocks else f"{name}.{len(self.blocks):03}"})
        return self.blocks[-1]


@pytest.fixture
def shaders(tmp_path):
    files = [tmp_path / folder / "scale.osl" for folder in ("gold", "skin")]
    for file in files:
        file.parent.mkdir()
        file.touch()
    return files


def test_materials_of_two_folders_coexist(shaders):
    blocks = Blocks()
    gold, skin = (own_data(blocks, "scale", shader) for shader in shaders)
    assert [block["shown"] for block in blocks] == ["scale", "scale.001"]
    assert own_data(blocks, "scale", shaders[0]) is gold
    assert own_data(blocks, "scale", shaders[1]) is skin
    assert own_data(blocks, "worn scale", shaders[0]) not in (gold, skin)


def test_a_moved_folder_rebuilds_its_material(shaders):
    blocks = Blocks()
    made = own_data(blocks, "scale", shaders[0])
    moved = shaders[0].parent.rename(shaders[0].parent.with_name("moved")) / shaders[0].name
    assert own_data(blocks, "scale", moved) is made
    assert own_data(blocks, "scale", moved) is made
    assert len(blocks.blocks) == 1


def test_a_users_material_of_that_name_stays(shaders):
    blocks = Blocks()
    users = blocks.new("scale")
    assert own_data(blocks, "scale", shaders[0]) is not users
    assert users == {"shown": "scale"}
