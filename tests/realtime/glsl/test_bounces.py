"""Light between surfaces on a grid: its values under an even sky, and dark regions of pictures."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.realtime.glsl import bounces
from mitsuba_diffraction.realtime.glsl.scene import read_scene
from mitsuba_diffraction.realtime.shader_comparison.measures import dark_region

pytestmark = pytest.mark.thorough

SIZE = (24, 16)
GRATING = md.gratings.sinusoidal(period=1.6, depth=0.06, periods=4)


@pytest.fixture(autouse=True)
def _few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounces, "_POINTS", 1 << 14)


def scene_of(**parts: Any) -> Any:
    transform = mi.ScalarTransform4f
    film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"}}
    view = transform().look_at([0, -6, 1.6], [0, 0, 0.9], [0, 0, 1])
    sensor = {"type": "perspective", "fov": 30, "film": film, "to_world": view}
    return mi.load_dict({"type": "scene", "sensor": sensor, **parts})


def floor(reflectance: float) -> dict[str, Any]:
    return {
        "type": "rectangle", "to_world": mi.ScalarTransform4f().scale(8),
        "bsdf": {"type": "diffuse", "reflectance": reflectance},
    }  # fmt: skip


def test_a_floor_under_an_even_sky_has_its_reflectance(some_variant: str) -> None:
    # a small plate so high that it hides nothing
    plate = {
        "type": "rectangle", "bsdf": md.bsdf_dict(GRATING, coherence_width=6, material="Al"),
        "to_world": mi.ScalarTransform4f().translate([0, 0, 6]).scale(0.05),
    }  # fmt: skip
    scene = scene_of(plate=plate, floor=floor(0.4), sky={"type": "constant", "radiance": 0.5})
    packed = bounces.pack_bounces(scene, read_scene(scene))
    low, cell, size = (packed.uniforms[f"bounces_{n}"] for n in ("low", "cell", "size"))
    cells = packed.textures[0].data.reshape(-1, 4)[: 12 * int(np.prod(size)), :3]
    # cells from the top down, then kind, axis, sign
    cells = cells.reshape(*size[::-1], 2, 3, 2, 3).astype(float)
    # the floor lies below the grid, so that its light is in the lowest cells
    assert low[2] > cell
    up = cells[0, :, :, 0, 2, 0]
    lit = up.sum(axis=-1) > 0.0
    assert lit.any()
    # sky × reflectance, within the noise of some hundred paths; the plate is in some of the cells
    np.testing.assert_allclose(np.median(up[lit], axis=0), 0.2, rtol=0.05)
    # from other surfaces nothing arrives but some light of the plate
    assert np.median(cells[0, :, :, 1, 2, 0]) < 1e-3


def test_metal_is_not_black_beside_a_floor(gl: Any, some_variant: str) -> None:
    """The criterion of `compare`: with light between surfaces no region of 5 % is dark."""
    from mitsuba_diffraction.realtime.glsl import Renderer

    ball = {
        "type": "sphere", "center": [0.0, 0.0, 1.0],
        "bsdf": md.bsdf_dict(GRATING, coherence_width=6, material="Au"),
    }  # fmt: skip
    lamp = {"type": "directional", "direction": [0.3, 0.6, -1.0], "irradiance": 3.0}
    scene = scene_of(ball=ball, floor=floor(0.6), lamp=lamp)
    integrator = mi.load_dict({"type": "path", "max_depth": 8})
    full = np.array(mi.render(scene, integrator=integrator, spp=128))[..., :3]
    renderer = Renderer(scene, context=gl)
    shares = []
    for kind in (False, True):
        light = renderer.progressive("fast", bounces=kind)
        light.advance(64)
        shares.append(dark_region(full, light.image[..., :3]))
        light.release()
    renderer.release()
    assert shares[0] > 0.05  # the scene is a test of it
    assert shares[1] < 0.05
