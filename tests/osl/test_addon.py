"""Content of the add-on for Blender."""

from __future__ import annotations

import json
import os
import shutil
import tomllib
import zipfile
from pathlib import Path

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.osl.blender_material import MaterialError, read_folder
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
