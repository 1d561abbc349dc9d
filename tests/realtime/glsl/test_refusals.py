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


@pytest.fixture
def flake(tmp_path: Path, some_variant: str) -> str:
    """A mesh of one triangle, without texture coordinates."""
    mesh = mi.Mesh("flake", 3, 1)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.array([0.0, 0, 0, 1, 0, 0, 0, 1, 0])
    parameters["faces"] = np.arange(3)
    parameters.update()
    mesh.write_ply(str(tmp_path / "flake.ply"))
    return str(tmp_path / "flake.ply")


def test_scenes_that_it_does_not_draw_are_refused(gl: Any, table_file: Path, flake: str) -> None:
    skin = {"bsdf": {"type": "diffraction", "filename": str(table_file)}}
    for sensor, shape, words in (
        ("perspective", {"type": "sphere"}, "no supported shape of the scene diffracts"),
        ("orthographic", {"type": "rectangle", **skin}, r"OrthographicCamera.*perspective"),
        ("perspective", {"type": "ply", "filename": flake, **skin},
         "flake: the mesh has no texture coordinates"),
    ):  # fmt: skip
        scene = mi.load_dict({"type": "scene", "sensor": {"type": sensor}, "flake": shape})
        with pytest.raises(DiffractionError, match=words):
            Renderer(scene, context=gl)


@pytest.mark.parametrize(
    ("version", "most", "words"),
    [
        (310, 16384, r"Ancient has OpenGL 3\.1, .*need 3\.3"),
        (330, 1024, r"Ancient supports textures of 1024 .* need 4096"),
    ],
)
def test_an_old_driver_is_refused_with_what_it_is(version: int, most: int, words: str) -> None:
    info = {"GL_RENDERER": "Ancient", "GL_MAX_TEXTURE_SIZE": most}
    with pytest.raises(DiffractionError, match=words):
        check_version(types.SimpleNamespace(version_code=version, info=info))


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
