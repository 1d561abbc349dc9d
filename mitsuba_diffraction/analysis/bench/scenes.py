"""Scenes to measure with: a furnace, a snake under a bright window, the snake of `scenes`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...errors import DiffractionError
from .contenders import Tables


def furnace(bsdf: Any, resolution: int) -> Any:
    """A ball that fills the picture's circle, under the same light from everywhere."""
    return mi.load_dict(
        {
            **_frame(
                mi.ScalarTransform4f().look_at(origin=[0, -3, 0], target=[0, 0, 0], up=[0, 0, 1]),
                resolution,
                resolution,
            ),
            "body": {"type": "sphere", "bsdf": bsdf},
            "light": {"type": "constant", "radiance": {"type": "d65"}},
        }
    )


def window() -> dict[str, Any]:
    """A dim sky, dark ground, and a bright window of 20 × 20 degrees."""
    return {
        "light": {
            "type": "envmap",
            "bitmap": mi.Bitmap(_window_map()),
            "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
        }
    }


def pigment(scenes: Path) -> dict[str, Any]:
    """The snake's own colours, to lie beneath the diffracting surface."""
    file = scenes / "textures" / "elaphe.png"
    _check_there(file)
    scale = mi.ScalarTransform4f().scale([0.05, 1.0, 1.0])
    return {
        "type": "diffuse",
        "reflectance": {"type": "bitmap", "filename": str(file), "to_uv": scale},
    }


def snake(bsdf: Any, scenes: Path, width: int, height: int, light: dict[str, Any]) -> Any:
    """The coiled snake without the ground.

    Raises
    ------
    DiffractionError
        If the mesh is missing.
    """
    mesh = scenes / "meshes" / "elaphe.ply"
    _check_there(mesh)
    above = mi.ScalarTransform4f().look_at(
        origin=[2.3, -32, 26], target=[1.4, -0.7, 0.6], up=[0, 0, 1]
    )
    return mi.load_dict(
        {
            **_frame(above @ mi.ScalarTransform4f().scale([9.0, 9.0, 1.0]), width, height),
            "body": {
                "type": "ply",
                "filename": str(mesh),
                "bsdf": {"type": "twosided", "bsdf": bsdf},
            },
            **light,
        }
    )


def snake_scene(scenes: Path, tables: Tables, **parameters: str) -> Any:
    """`snake.xml` with the default table.

    Raises
    ------
    DiffractionError
        If it is missing.
    """
    file = scenes / "snake.xml"
    _check_there(file)
    return mi.load_file(str(file), patch=str(tables.paths["default"]), **parameters)


def skin_of(scene: Any) -> Any:
    """The snake in its scene."""
    return next(shape for shape in scene.shapes() if shape.id() == "snake")


def pixels_of(scene: Any, shape: Any) -> Any:
    """Which pixels see the shape at their centre, (height, width) of bool."""
    width, height = scene.sensors()[0].film().crop_size()
    _, ray = rays(scene, 1)
    found = scene.ray_intersect_preliminary(ray)
    seen = found.is_valid() & (found.shape == mi.ShapePtr(shape))
    return np.array(seen, bool).reshape(height, width)


def rays(scene: Any, side: int) -> tuple[int, Any]:
    """Number of pixels, and side² rays through each of them, one pixel after the other."""
    sensor = scene.sensors()[0]
    width, height = sensor.film().crop_size()
    index = dr.arange(mi.UInt32, width * height * side**2)
    pixel, part = index // side**2, index % side**2
    position = mi.Point2f(
        (mi.Float(pixel % width) + (mi.Float(part % side) + 0.5) / side) / width,
        (mi.Float(pixel // width) + (mi.Float(part // side) + 0.5) / side) / height,
    )
    return width * height, sensor.sample_ray(0.0, 0.5, position, mi.Point2f(0.5))[0]


def share_of(scene: Any, shape: Any) -> float:
    """Share of the pixels that see the shape."""
    return float(pixels_of(scene, shape).mean())


def _check_there(file: Path) -> None:
    if not file.is_file():
        raise DiffractionError(
            f"'{file}' does not exist; run this where the project's scenes are, or name their "
            "folder with --scenes"
        )


def _frame(to_world: Any, width: int, height: int) -> dict[str, Any]:
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": {
            "type": "orthographic",
            "to_world": to_world,
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent"},
        },
    }


def _window_map(rows: int = 128) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Latitude-longitude map (rows, 2 rows, 3) of the `window`."""
    light = np.full((rows, 2 * rows, 3), 0.5, np.float32)
    light[rows // 2 :] = 0.05
    degree = rows / 180.0
    top, left = int(35 * degree), int(200 * degree)
    light[top : top + int(20 * degree), left : left + int(20 * degree)] = 30.0
    return light
