"""Light that is accumulated: its mean is all direct light, its shadows are soft and clean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction.realtime.glsl.renderer import Renderer

pytestmark = pytest.mark.filterwarnings("ignore:the realtime picture does not show")

#: A disc light of radius 0.5 at the height 6, and the edge of a screen at the height 2.
RADIUS, HIGH, EDGE = 0.5, 6.0, 2.0


def diffuse(value: float = 0.5) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}


def plate_scene(table_file: Path, **parts: Any) -> Any:
    """A plate at z = 0 seen from above, with something out of sight that diffracts."""
    T = mi.ScalarTransform4f
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": T().look_at([0, -8, 1.5], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 96, "height": 24},
            },
            "plate": {"type": "rectangle", "to_world": T().scale(4.0), "bsdf": diffuse()},
            "skin": {
                "type": "rectangle",
                "to_world": T().translate([0, 8, -0.5]).scale(0.1),
                "bsdf": {"type": "diffraction", "table": str(table_file)},
            },
            **parts,
        }
    )


def truth(scene: Any, spp: int = 256) -> NDArray[np.float64]:
    """Direct light by the path tracer, a pixel the mean over its square."""
    sensor = scene.sensors()[0]
    width, height = (int(n) for n in sensor.film().size())
    made = mi.load_dict(
        {
            "type": "perspective",
            "fov": 30,
            "to_world": mi.traverse(sensor)["to_world"],
            "film": {
                "type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                "component_format": "float32", "rfilter": {"type": "box"},
            },
        }
    )  # fmt: skip
    integrator = mi.load_dict({"type": "direct"})
    return np.array(mi.render(scene, sensor=made, integrator=integrator, spp=spp), np.float64)


def places_on_plate(camera: Any) -> NDArray[np.float64]:
    """(height, width, 3) where rays through the pixels' middles meet z = 0."""
    width, height = camera.size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    half = np.tan(np.radians(0.5 * camera.fov))
    local = np.stack([(1 - 2 * x) * half, (1 - 2 * y) * half * height / width, 0 * x + 1], -1)
    rays = local @ camera.to_world[:3, :3].T
    return camera.eye - rays * (camera.eye[2] / rays[..., 2:])


def irradiance_of_disc(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the disc with radiance 1 at places (n, 3) of the plate; the screen covers x < 0.

    By quadrature over the disc: ∫ cos²θ/d² dA, θ being the same at both.
    """
    n = 400
    r = (np.arange(n) + 0.5) / n * RADIUS
    phi = (np.arange(n) + 0.5) / n * 2 * np.pi
    px, py = (r[:, None] * f(phi) for f in (np.cos, np.sin))
    area = (r[:, None] * RADIUS / n * 2 * np.pi / n) + 0 * px
    found = []
    for x, y, _ in places:
        square = (px - x) ** 2 + (py - y) ** 2 + HIGH**2
        # the screen's edge as seen from the place, on the disc's plane
        limit = x - x * HIGH / EDGE
        found.append(float((area * (px > limit) * HIGH**2 / square**2).sum()))
    return np.array(found)


def test_the_penumbra_of_a_disc_is_the_analytic_one(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    T = mi.ScalarTransform4f
    scene = plate_scene(
        table_file,
        lamp={
            "type": "disk",
            "to_world": T().translate([0, 0, HIGH]).rotate([1, 0, 0], 180).scale(RADIUS),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 40.0}},
        },
        # from x = −5 to 0, out of the camera's sight
        screen={
            "type": "rectangle",
            "to_world": T().translate([-5, 0, EDGE]).scale([5, 3, 1]),
            "bsdf": diffuse(0.0),
        },
    )
    renderer = Renderer(scene, context=gl)
    light = renderer.progressive(size=(192, 48), shadow_size=512)
    light.advance(256)
    row = light.image[24, :, 1]
    places = places_on_plate(renderer.camera.resized(192, 48))[24]
    light.release()
    renderer.release()
    expected = irradiance_of_disc(places) * 40.0 * 0.5 / np.pi
    assert (expected < 0.02 * expected.max()).sum() > 20
    assert ((expected > 0.1 * expected.max()) & (expected < 0.9 * expected.max())).sum() > 10
    assert np.abs(row - expected).max() < 0.02 * expected.max()
