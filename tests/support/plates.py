"""Plates that diffract, alone or in a small scene."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.support.directions import Array, rough_patch, uniform_directions

PATCH = rough_patch((48, 50), (0.1, 0.1), 0.12)
OTHER = rough_patch((40, 44), (0.12, 0.1), 0.3, seed=2)
RAW = {"coherence_width": 5.0, "energy_conserving": False, "material": "none"}
WAVELENGTHS = [[400.0, 480.0, 560.0, 700.0]]


def diffraction(field: md.HeightField = PATCH, **parameters: Any) -> dict[str, Any]:
    return md.bsdf_dict(field, **(RAW | parameters))


def pairs(n: int = 300, seed: int = 0) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return uniform_directions(n, rng, 0.3), uniform_directions(n, rng, 0.3)


def grey(value: float, **parameters: Any) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "uniform", "value": value}, **parameters}


def camera(origin: list[float], size: int, fov: float = 40.0, **film: Any) -> dict[str, Any]:
    """A camera that looks at the world's origin, y up, with a square film of so many pixels."""
    to_world = mi.ScalarTransform4f().look_at(origin=origin, target=[0, 0, 0], up=[0, 1, 0])
    film |= {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    return {"type": "perspective", "fov": fov, "to_world": to_world, "film": film}


def scene(*shapes: dict[str, Any], size: int = 12, **parameters: Any) -> Any:
    """Shapes under one lamp and a sky, seen from above."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": camera([0, 0, 4], size),
            "sky": {"type": "constant", "radiance": 0.3},
            "lamp": {"type": "directional", "direction": [0.1, 0.3, -1.0], "irradiance": 1.0},
            **{f"shape {n}": shape for n, shape in enumerate(shapes)},
            **parameters,
        }
    )


def plate(bsdf: Any, x: float = 0.0, **parameters: Any) -> dict[str, Any]:
    """A plate 1.2 wide at x."""
    place = mi.ScalarTransform4f().translate([x, 0, 0]).scale([0.6, 1.2, 1.0])
    return {"type": "rectangle", "bsdf": bsdf, "to_world": place, **parameters}


def rendered(scene: Any, spp: int = 64, seed: int = 0) -> Array:
    return np.array(mi.render(scene, spp=spp, seed=seed), float)
