"""The add-on for Blender: what the zip holds, and that Blender installs and uses it."""

from __future__ import annotations

import tomllib
import zipfile
from pathlib import Path

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from tests.support.blender import blender, result_of
from tests.support.orders import thin_grating

_INSTALLED = """
import os
os.environ["BLENDER_USER_RESOURCES"] = home
import bpy
bpy.ops.extensions.package_install_files(filepath=file, repo="user_default", enable_on_install=True)
before = sorted(m.name for m in bpy.data.materials)
bpy.ops.material.diffraction_look(look="grating")
added = bpy.context.object.active_material.name
bpy.ops.material.diffraction_assets()
folder = [entry.path for entry in bpy.context.preferences.filepaths.asset_libraries
          if entry.name == "Diffraction"]
library = os.path.join(folder[0], "looks.blend")
with bpy.data.libraries.load(library, assets_only=True) as (there, _):
    assets = list(there.materials)
result = {"before": before, "added": added, "assets": assets,
          "after": sorted(m.name for m in bpy.data.materials)}
"""


@pytest.fixture
def folder(tmp_path: Path, some_variant: str) -> Path:
    bsdf = mi.load_dict(md.bsdf_dict(thin_grating(), coherence_width=12.0))
    md.osl.export(bsdf, tmp_path / "exported", "grating")
    return tmp_path / "exported"


def test_the_archive_has_a_manifest_and_the_looks(folder: Path, tmp_path: Path) -> None:
    md.osl.make_addon({"grating": folder}, tmp_path / "looks.zip")
    with zipfile.ZipFile(tmp_path / "looks.zip") as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert {"__init__.py", "blender_material.py", "looks/grating/grating.osl"} <= names
    assert {f"looks/grating/{file.name}" for file in folder.glob("*.exr")} <= names
    assert manifest["type"] == "add-on"
    assert manifest["id"].isidentifier()


def test_a_folder_without_an_export_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DiffractionError, match="export-osl"):
        md.osl.make_addon({"grating": tmp_path}, tmp_path / "looks.zip")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.thorough
def test_blender_installs_it_and_has_assets(folder: Path, tmp_path: Path) -> None:
    blender()
    file = tmp_path / "looks.zip"
    md.osl.make_addon({"grating": folder}, file)
    (tmp_path / "home").mkdir()
    found = result_of(_INSTALLED, tmp_path, file=str(file), home=str(tmp_path / "home"))
    assert found["added"] == "grating"
    assert found["assets"] == ["grating"]
    # the open file has the material that was added, and none of the library's
    assert found["after"] == sorted([*found["before"], "grating"])
