"""Small scenes for both renderers: a shape, a surface, a light and a camera.

Mitsuba gets a dictionary, Blender the same numbers as JSON (`inside.py`). Lengths have no unit;
directions are those of Mitsuba's scenes: z is up, the camera looks along +y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from mitsuba_diffraction.arrays import Single

#: Shapes of unit radius, or half side, around the origin, as Mitsuba names them.
SHAPES = ("disk", "rectangle", "sphere")
LIGHTS = ("lamp", "sky")

#: Lamp: position, radius and radiance of a disk that faces the origin, in a dim room.
_LAMP = {"position": (1.0, 1.5, 3.5), "radius": 0.8, "radiance": 2.0}
_ROOM = 0.05
#: Camera: position, target, and the horizontal angle of view in degrees.
_CAMERA = {"position": (0.0, -4.0, 3.5), "target": (0.0, 0.0, 0.0), "angle": 30.0}
#: Height of the environment map in pixels; its width is twice that.
_ROWS = 128


@dataclass(frozen=True)
class Surface:
    """A material of both renderers.

    Attributes
    ----------
    mitsuba : dictionary of a BSDF.
    cycles : material for `inside.py`: `{"grey": reflectance}`, `{"glossy": α}`, or
        `{"folder": exported folder, "tangent": as --tangent, "inputs": {name: value}}`.
    """

    mitsuba: Mapping[str, Any]
    cycles: Mapping[str, Any]


@dataclass(frozen=True)
class View:
    """A shape with a surface in a light.

    Attributes
    ----------
    shape, light : of `SHAPES` and `LIGHTS`.
    surface : of the shape.
    width, height : pixels.
    """

    shape: str
    light: str
    surface: Surface
    width: int = 160
    height: int = 107

    def for_mitsuba(self) -> dict[str, Any]:
        """Return the scene for `mi.load_dict`."""
        camera = mi.ScalarTransform4f().look_at(
            origin=_CAMERA["position"], target=_CAMERA["target"], up=[0, 0, 1]
        )
        film = {
            "type": "hdrfilm",
            "width": self.width,
            "height": self.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        }
        return {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "sensor": {
                "type": "perspective",
                "fov": _CAMERA["angle"],
                "fov_axis": "x",
                "to_world": camera,
                "film": film,
            },
            "shape": {"type": self.shape, "bsdf": dict(self.surface.mitsuba)},
            **(_lamp() if self.light == "lamp" else _sky()),
        }

    def for_cycles(self, folder: Path) -> dict[str, Any]:
        """Return the scene for `inside.py`; writes the environment map to the folder."""
        light: dict[str, Any] = {**_LAMP, "room": _ROOM}
        if self.light == "sky":
            sky = folder / "sky.exr"
            mi.Bitmap(sky_radiance()).write(str(sky))
            light = {"file": str(sky)}
        return {
            "shape": self.shape,
            "light": light,
            "camera": _CAMERA,
            "surface": dict(self.surface.cycles),
            "size": [self.width, self.height],
        }


def sky_radiance() -> Single:
    """Return an environment map (`_ROWS`, 2 `_ROWS`, 3): a grey sky, brighter around a low sun.

    Row 0 is up. The columns begin at −x and run towards +y, as Blender's.
    """
    elevation = np.pi * (0.5 - (np.arange(_ROWS) + 0.5) / _ROWS)[:, None]
    azimuth = np.pi - np.pi / _ROWS * (np.arange(2 * _ROWS) + 0.5)[None, :]
    x, y = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth)
    direction = np.stack([x, y, np.sin(elevation) + 0.0 * azimuth], axis=-1)
    sun = np.array([0.3, 0.75, 0.6]) / np.linalg.norm([0.3, 0.75, 0.6])
    glow = np.exp((direction @ sun - 1.0) / 0.02)  # 0.2 radians wide
    radiance = 0.15 + 0.25 * np.clip(direction[..., 2], 0.0, 1.0) + 4.0 * glow
    return np.repeat(radiance[..., None], 3, axis=-1).astype(np.float32)


def _lamp() -> dict[str, Any]:
    place = mi.ScalarTransform4f().look_at(origin=_LAMP["position"], target=[0, 0, 0], up=[0, 0, 1])
    lamp = {
        "type": "disk",
        "to_world": place @ mi.ScalarTransform4f().scale(_LAMP["radius"]),
        "emitter": {"type": "area", "radiance": _grey(_LAMP["radiance"])},
    }
    return {"lamp": lamp, "room": {"type": "constant", "radiance": _grey(_ROOM)}}


def _grey(radiance: float) -> dict[str, Any]:
    return {"type": "rgb", "value": radiance}


def _sky() -> dict[str, Any]:
    # from Mitsuba's map, whose y is up and whose columns begin at −z
    upright = mi.ScalarTransform4f().rotate([0, 0, 1], 90).rotate([1, 0, 0], 90)
    sky = {"type": "envmap", "bitmap": mi.Bitmap(sky_radiance()), "to_world": upright}
    return {"sky": sky}
