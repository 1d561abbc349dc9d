"""Closed surfaces of all materials, drawn without the triangles that face away."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.realtime.glsl import renderer
from mitsuba_diffraction.realtime.glsl.shader_materials import GLSL
from tests.support.surfaces import SURFACES

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.usefixtures("some_variant"),
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]


def ball(folder: Path, clockwise: bool) -> str:
    """Write a ball whose triangles are clockwise, or counter-clockwise, from outside."""
    rows, columns = 16, 32
    theta, phi = np.meshgrid(
        np.linspace(0.0, np.pi, rows + 1), np.linspace(0.0, 2.0 * np.pi, columns + 1), indexing="ij"
    )
    places = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    faces = np.concatenate([np.stack([a, c, b], 1)[columns:], np.stack([b, c, d], 1)[:-columns]])
    values = {"positions": places, "normals": places, "texcoords": np.stack([phi, theta], -1)}
    mesh = mi.Mesh("ball", theta.size, len(faces), has_vertex_normals=True,
                   has_vertex_texcoords=True)  # fmt: skip
    parameters = mi.traverse(mesh)
    for key, value in values.items():
        parameters[f"vertex_{key}"] = value.astype(np.float32).ravel()
    parameters["faces"] = (faces[:, ::-1] if clockwise else faces).astype(np.uint32).ravel()
    parameters.update()
    file = folder / f"ball_{clockwise}.ply"
    mesh.write_ply(str(file))
    return str(file)


def scene_of_balls(folder: Path) -> dict[str, Any]:
    """One ball of each surface that shaders show, in rows."""
    T = mi.ScalarTransform4f
    loaded = {name: mi.load_dict(make(folder)) for name, make in SURFACES.items()}
    shown = [b for b in loaded.values() if not GLSL.refusal(describe(b))]
    assert len(shown) > 25
    balls = {
        f"ball {n}": {
            "type": "ply", "filename": ball(folder, clockwise=n % 2 == 1), "bsdf": bsdf,
            "to_world": T().translate([2.2 * (n % 6) - 5.5, 2.2 * (n // 6) - 6.6, 0.0]),
        }
        for n, bsdf in enumerate(shown)
    }  # fmt: skip
    view = T().look_at([0.0, -20.0, 60.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    film = {"type": "hdrfilm", "width": 96, "height": 96}
    light = {
        "type": "rectangle", "emitter": {"type": "area", "radiance": 20.0},
        "to_world": T().look_at([10.0, 0.0, 20.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
    }  # fmt: skip
    return {
        "type": "scene", **balls, "light": light, "sky": {"type": "constant"},
        "sensor": {"type": "perspective", "fov": 14.0, "to_world": view, "film": film},
    }  # fmt: skip


def test_triangles_that_face_away_change_no_picture(gl, tmp_path, monkeypatch):
    scene = mi.load_dict(scene_of_balls(tmp_path))
    enable, drawn, pictures = renderer.enable_sides, list[int](), []

    def noted(context: Any, winding: int) -> None:
        drawn.append(winding)
        enable(context, winding if len(pictures) == 0 else 0)

    monkeypatch.setattr(renderer, "enable_sides", noted)
    made = renderer.Renderer(scene, context=gl)
    for _ in range(2):
        light = made.progressive("fast")
        light.advance(4)  # of the lamp and of the sky, the same samples in both pictures
        pictures.append(light.image[..., :3].astype(float))
        light.release()
    made.release()
    assert {-1, 1} <= set(drawn)
    culled, whole = pictures
    # a triangle behind wins where depths are equal, at the outlines
    assert np.abs(culled - whole).mean() < 1e-3 * whole.mean()
