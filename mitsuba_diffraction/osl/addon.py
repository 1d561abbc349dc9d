"""Add-on for Blender: a zip of exported surfaces that Blender installs."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from importlib import resources
from importlib.metadata import version
from pathlib import Path

from ..atomic import atomic_path
from ..errors import DiffractionError
from .blender_material import MaterialError, read_folder
from .export import SCRIPT

_MANIFEST = """schema_version = "1.0.0"
id = "mitsuba_diffraction"
version = "{version}"
name = "Diffraction"
tagline = "Iridescence of measured surfaces in Cycles"
maintainer = "mitsuba_diffraction contributors"
type = "add-on"
tags = ["Material", "Render"]
blender_version_min = "5.0.0"
license = ["SPDX:MIT"]
"""
#: Largest size of the archive, bytes, which Blender's extensions platform sets at 200 MB.
MAX_BYTES = 200_000_000


def make_addon(folders: Mapping[str, Path], path: Path) -> None:
    """Write the add-on; a texture that several looks have is in it once.

    Parameters
    ----------
    folders : exported folders by the name of the look in Blender.
    path : zip to write.

    Raises
    ------
    DiffractionError
        If a folder has not been exported, or the archive would be too large.
    """
    here = resources.files(__package__)
    with atomic_path(path) as temporary:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            manifest = _MANIFEST.format(version=version("mitsuba_diffraction"))
            archive.writestr("blender_manifest.toml", manifest)
            archive.writestr("__init__.py", here.joinpath("blender_addon.py").read_bytes())
            archive.writestr(SCRIPT, here.joinpath(SCRIPT).read_bytes())
            for name, folder in folders.items():
                try:
                    exported = read_folder(folder)
                except MaterialError as error:
                    raise DiffractionError(str(error)) from error
                names = {
                    key: hashlib.sha256(file.read_bytes()).hexdigest()[:16] + ".exr"
                    for key, file in exported["textures"].items()
                }
                for key, file in exported["textures"].items():
                    if (packed := f"textures/{names[key]}") not in archive.namelist():
                        archive.write(file, packed)
                shader = exported["shader"]
                document = json.loads(shader.with_suffix(".json").read_text(encoding="utf-8"))
                document["textures"] = names
                text = json.dumps(document, indent=1, ensure_ascii=False)
                archive.write(shader, f"looks/{name}/{shader.name}")
                archive.writestr(f"looks/{name}/{shader.stem}.json", text)
        if (size := temporary.stat().st_size) > MAX_BYTES:
            raise DiffractionError(
                f"the add-on would have {size / 1e6:.0f} MB, more than {MAX_BYTES / 1e6:.0f}; "
                "choose fewer surfaces"
            )
