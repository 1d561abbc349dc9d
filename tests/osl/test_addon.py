"""Content of the add-on for Blender."""

from __future__ import annotations

import tomllib
import zipfile
from pathlib import Path

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from tests.support.orders import thin_grating


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
