"""Lights drawn from the emitters of a scene, and light between surfaces on a grid.

Lights are together as bright as the emitters, and a few are like all. Between surfaces: values
under an even sky, and dark regions.
"""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction as md
from mitsuba_diffraction.realtime.glsl import bounces
from mitsuba_diffraction.realtime.glsl.emitters import Emitters, emission
from mitsuba_diffraction.realtime.glsl.scene import read_scene
from mitsuba_diffraction.realtime.shader_comparison.measures import dark_region

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore:the realtime picture does not show"),
]


def irradiance(lights: list[Any], normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over lights of what they bring to a plane at the origin, linear sRGB (3,)."""
    total = np.zeros(3)
    for light in lights:
        direction = light.place[:3].copy()
        share = 1.0
        if light.place[3] == 1.0:
            square = float(direction @ direction)
            direction /= np.sqrt(square)
            share = emission(light, -direction) / square
        total += light.colour * share * max(float(direction @ normal), 0.0)
    return total / len(lights)


def test_a_few_lights_look_like_all_of_them(some_variant: str) -> None:
    """A sky with its sun, a window and a lamp: eight lights of some hundreds."""
    T = mi.ScalarTransform4f
    pane = T().look_at([3, 0, 2], [0, 0, 0], [0, 0, 1])
    scene = mi.load_dict(
        {
            "type": "scene",
            "sky": {"type": "sunsky", "sun_direction": [-0.4, 0.6, 0.7], "sun_scale": 10.0,
                    "sky_scale": 10.0},
            "window": {
                "type": "rectangle", "to_world": pane,
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 60.0}},
            },
            "lamp": {"type": "point", "position": [0.0, -3.0, 3.0], "intensity": 1000.0},
        }
    )  # fmt: skip
    emitters = Emitters(scene, np.zeros(3))
    assert emitters.probabilities.min() > 0.05
    lights = list(itertools.islice(emitters.lights(), 256))
    whole, few, more = (
        np.array([irradiance(some, normal) for normal in np.eye(3)])
        for some in (lights, lights[:8], lights[:32])
    )
    # one light more or less of an emitter that is chosen for a fifth of them: 1/8 and 1/32
    assert np.abs(few - whole).max() < whole.max() / 8
    assert np.abs(more - whole).max() < whole.max() / 32


def test_lights_from_emitters_bring_what_the_emitters_bring(some_variant: str) -> None:
    """The mean over lights on a plane is the irradiance that Mitsuba finds there."""
    T = mi.ScalarTransform4f
    picture = np.full((8, 16, 3), 0.2, np.float32)
    picture[1:3, 3:6] = [20.0, 5.0, 1.0]
    away = np.array([0.4, -0.3, 0.0])
    for part in (
        {"type": "envmap", "bitmap": mi.Bitmap(picture), "to_world": T().rotate([1, 0, 0], 90)},
        {"type": "constant", "radiance": {"type": "rgb", "value": 0.7}},
        {"type": "spot", "intensity": {"type": "rgb", "value": 9.0}, "cutoff_angle": 35,
         "beam_width": 5, "to_world": T().look_at([0, 0, 3], [0.5, 0, 0], [0, 1, 0])},
        {"type": "disk", "to_world": T().translate([0.5, 0, 1]).rotate([1, 0, 0], 160).scale(0.4),
         "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 5.0}}},
    ):  # fmt: skip
        white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
        plane = {"type": "rectangle", "to_world": T().translate(away.tolist()).scale(1e-3)}
        scene = mi.load_dict({"type": "scene", "part": part, "plane": {**plane, "bsdf": white}})
        # weighed where the light is drawn for, and seen beside it
        lights = list(itertools.islice(Emitters(scene, np.zeros(3)).lights(), 512))
        moved = [
            dataclasses.replace(light, place=light.place - np.append(away, 0.0) * light.place[3])
            for light in lights
        ]
        sensor = mi.load_dict(
            {
                "type": "perspective", "fov": 1e-3,
                "to_world": T().look_at([0.4, -0.3, 0.1], [0.4, -0.3, 0.0], [0, 1, 0]),
                "film": {
                    "type": "hdrfilm", "width": 1, "height": 1, "pixel_format": "rgb",
                    "component_format": "float32", "rfilter": {"type": "box"},
                },
            }
        )  # fmt: skip
        integrator = mi.load_dict({"type": "direct", "bsdf_samples": 0, "emitter_samples": 1})
        seen = mi.render(scene, sensor=sensor, integrator=integrator, spp=1 << 16)
        expected = np.pi * np.array(seen, float).ravel()
        found = irradiance(moved, np.array([0.0, 0.0, 1.0]))
        # noise of Mitsuba's samples, and the colours of its spectra
        assert found == pytest.approx(expected, rel=0.02), part["type"]


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
    assert shares[0] > 0.05  # the scene has such light
    assert shares[1] < 0.05
