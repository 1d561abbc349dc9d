"""The add-on for Blender, and blender_material.py without Blender: refusals, materials rebuilt."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mitsuba as mi
import pytest

import mitsuba_diffraction
import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.osl.blender_material import MaterialError, own_data, read_folder
from tests.support.orders import thin_grating


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An exported folder, which takes seconds: its error is measured."""
    mi.set_variant("scalar_spectral")
    bsdf = mi.load_dict(md.bsdf_dict(thin_grating(0.6, counts=(2, 2, 1)), coherence_width=12.0))
    folder = tmp_path_factory.mktemp("addon") / "exported"
    md.osl.export(bsdf, folder, "grating")
    return folder


@pytest.fixture
def folder(tmp_path: Path, exported: Path) -> Path:
    """A copy to be damaged."""
    return Path(shutil.copytree(exported, tmp_path / "exported"))


def test_the_archive_has_a_manifest_and_the_looks(folder: Path, tmp_path: Path) -> None:
    md.osl.make_addon({"grating": folder}, tmp_path / "looks.zip")
    with zipfile.ZipFile(tmp_path / "looks.zip") as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert {"__init__.py", "blender_material.py", "looks/grating/grating.osl"} <= names
    assert sum(name.startswith("textures/") for name in names) == len([*folder.glob("*.exr")])
    assert manifest["type"] == "add-on"
    assert manifest["id"].isidentifier()


def test_looks_share_their_textures(folder: Path, tmp_path: Path) -> None:
    md.osl.make_addon({"one": folder, "two": folder}, tmp_path / "looks.zip")
    with zipfile.ZipFile(tmp_path / "looks.zip") as archive:
        archive.extractall(tmp_path / "addon")
    names = sorted(file.name for file in (tmp_path / "addon/textures").iterdir())
    assert len(names) == len([*folder.glob("*.exr")])
    for look in ("one", "two"):
        read = read_folder(tmp_path / "addon/looks" / look, tmp_path / "addon/textures")
        assert sorted(file.name for file in read["textures"].values()) == names
    with pytest.raises(MaterialError):
        read_folder(tmp_path / "addon/looks/one")


def test_a_folder_without_an_export_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DiffractionError, match="export-osl"):
        md.osl.make_addon({"grating": tmp_path}, tmp_path / "looks.zip")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../secret", "{outside}", "link", "pipe", "note"])
@pytest.mark.parametrize("part", ["shader", "textures"])
def test_nothing_outside_of_the_folder_is_packed(
    folder: Path, tmp_path: Path, part: str, name: str
) -> None:
    """A document from somebody else might name a private file."""
    suffix = ".osl" if part == "shader" else ".exr"
    (tmp_path / f"secret{suffix}").write_text("private")
    (folder / f"link{suffix}").symlink_to(tmp_path / f"secret{suffix}")
    (folder / "note.txt").write_text("private")
    os.mkfifo(folder / f"pipe{suffix}")
    document = next(folder.glob("*.json"))
    content = json.loads(document.read_text())
    named = name.format(outside=tmp_path / "secret") + (".txt" if name == "note" else suffix)
    content[part] = named if part == "shader" else content[part] | {"extra": named}
    document.write_text(json.dumps(content))
    with pytest.raises(DiffractionError):
        md.osl.make_addon({"grating": folder}, tmp_path / "looks.zip")
    assert not (tmp_path / "looks.zip").exists()


def test_a_document_that_is_a_link_is_not_packed(folder: Path, tmp_path: Path) -> None:
    document = next(folder.glob("*.json"))
    document.rename(tmp_path / "elsewhere.json")
    document.symlink_to(tmp_path / "elsewhere.json")
    with pytest.raises(DiffractionError, match="export-osl"):
        md.osl.make_addon({"grating": folder}, tmp_path / "looks.zip")


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
