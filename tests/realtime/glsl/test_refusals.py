"""Refusals of the realtime renderer: scenes that it does not draw, drivers that are too old."""

from __future__ import annotations

import types
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.realtime.glsl.context import check_version, headless_context
from mitsuba_diffraction.realtime.glsl.renderer import Renderer

pytestmark = pytest.mark.thorough

SENSOR = {"type": "perspective"}


def test_a_scene_without_diffraction_is_refused(gl: Any, some_variant: str) -> None:
    scene = mi.load_dict({"type": "scene", "sensor": SENSOR, "ball": {"type": "sphere"}})
    with pytest.raises(DiffractionError, match="no supported shape of the scene diffracts"):
        Renderer(scene, context=gl)


def test_cameras_without_perspective_are_refused(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    # what the shaders draw
    skin = {"type": "diffraction", "filename": str(table_file), "model": "kirchhoff"}
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "orthographic"},
            "plate": {"type": "rectangle", "bsdf": skin},
        }
    )
    with pytest.raises(DiffractionError, match=r"OrthographicCamera.*perspective"):
        Renderer(scene, context=gl)


def test_an_old_driver_is_refused_with_what_it_is() -> None:
    old = types.SimpleNamespace(version_code=310, info={"GL_RENDERER": "Ancient"})
    with pytest.raises(DiffractionError, match=r"Ancient has OpenGL 3\.1, .*need 3\.3"):
        check_version(old)


def test_a_driver_with_small_textures_is_refused() -> None:
    info = {"GL_RENDERER": "Tiny", "GL_MAX_TEXTURE_SIZE": 1024}
    with pytest.raises(DiffractionError, match=r"Tiny supports textures of 1024 .* need 4096"):
        check_version(types.SimpleNamespace(version_code=330, info=info))


def test_a_mesh_without_texture_coordinates_is_refused(
    gl: Any, some_variant: str, table_file: Path, tmp_path: Path
) -> None:
    mesh = mi.Mesh("flake", 3, 1)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.array([0.0, 0, 0, 1, 0, 0, 0, 1, 0])
    parameters["faces"] = np.arange(3)
    parameters.update()
    mesh.write_ply(str(tmp_path / "flake.ply"))
    flake = {"type": "ply", "filename": str(tmp_path / "flake.ply")}
    skin = {"type": "diffraction", "filename": str(table_file)}
    scene = {"type": "scene", "sensor": SENSOR, "flake": {**flake, "bsdf": skin}}
    with pytest.raises(DiffractionError, match="flake: the mesh has no texture coordinates"):
        Renderer(mi.load_dict(scene), context=gl)


def test_a_missing_driver_is_one_line_that_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    moderngl = pytest.importorskip("moderngl")

    def fail(**_: object) -> None:
        raise Exception("libEGL.so not\nfound")

    monkeypatch.setattr(moderngl, "create_standalone_context", fail)
    with pytest.raises(DiffractionError, match="apt install libegl1") as caught:
        headless_context()
    assert "\n" not in str(caught.value)
