"""What a scene is surrounded by, for light that is looked up along directions of a surface's lobes.

Narrow lobes hardly ever meet a light that was drawn without regard to them. So every other frame of
`progressive` draws a direction from the surface's own lobe at each pixel, and looks up what comes
from there: area lights that are flat, and the environment. The two kinds of frames share the light
by the balance heuristic (Veach and Guibas 1995).

What such a direction meets first is exact of rectangles and disks. All else that stands in the way
is found on a grid (`obstacles`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...plugin.names import name_of
from .lights import emitted_radiance, radiance_along
from .shadows import frame_along
from .shapes import a_normal
from .texels import Packed, Texture, Uniform, as_half

Array = NDArray[np.float64]

_SKY = (128, 256)  # rows and columns of an environment that is no picture, and the fewest of one
_LARGEST = (512, 1024)  # the most
_SUN_RADIUS = np.radians(0.2679)  # as Mitsuba has it
_AROUND_SUN = np.radians(0.6)  # within this, a sky's sun is left to the lights
_FLATS = 12
_PLASTIC = [0.8191725134, 0.6710436067, 0.5497004779]  # steps in three numbers (Roberts 2018)


@dataclass(frozen=True)
class Environment:
    """Radiance from infinitely far away.

    Attributes
    ----------
    emitter : of Mitsuba.
    picture : (rows, columns, 3) linear sRGB without the sun's disc, rows over the angle from the z
        axis, columns around it.
    sun : (3,) the direction towards its middle, or zeros.
    sun_radiance : (3,) linear sRGB, the mean over the disc.
    """

    emitter: Any
    picture: NDArray[np.float32]
    sun: Array
    sun_radiance: Array

    @classmethod
    def of(cls, scene: Any) -> Environment | None:
        """Of a Mitsuba scene, if it has one.

        Raises
        ------
        DiffractionError
            If it is not finite.
        """
        import mitsuba as mi

        emitter = scene.environment()
        if emitter is None:
            return None
        parameters = mi.traverse(emitter)
        rows, columns = _SKY
        if "data" in parameters:
            shape = parameters["data"].shape
            rows, columns = np.clip(shape[:2], _SKY, _LARGEST).tolist()
        theta = np.pi * (np.arange(rows)[:, None] + 0.5) / rows
        phi = 2.0 * np.pi * (np.arange(columns) + 0.5) / columns
        directions = _directions(theta, phi)
        sun, radiance = np.zeros(3), np.zeros(3)
        if "sun_direction" in parameters:
            sun = np.array(parameters["sun_direction"], float).ravel()
            directions = _beside(sun, directions)
            radiance = radiance_along(emitter, _disc(sun, _SUN_RADIUS)).mean(axis=0)
        with np.errstate(invalid="ignore"):
            picture = radiance_along(emitter, directions.reshape(-1, 3))
        if not (np.isfinite(picture).all() and np.isfinite(radiance).all()):
            raise DiffractionError(
                f"{name_of(emitter)}: the environment has radiances that are not finite; "
                "give a picture without them"
            )
        picture = picture.reshape(rows, columns, 3)
        return cls(emitter, np.maximum(picture, 0.0).astype(np.float32), sun, radiance)

    def in_sun(self, directions: Array) -> NDArray[np.bool_]:
        """Which of (n, 3) unit vectors lead to the sun."""
        return np.asarray(directions @ self.sun > np.cos(_AROUND_SUN))

    @property
    def areas(self) -> Array:
        """Solid angles of the picture's texels (rows, 1)."""
        edges = np.cos(np.linspace(0.0, np.pi, len(self.picture) + 1))
        return np.asarray(-np.diff(edges)[:, None] * 2.0 * np.pi / self.picture.shape[1])

    def drawn(self, start: int, count: int) -> tuple[Array, Array]:
        """Directions (count, 3) as dense as the picture is bright, and their densities (count,).

        Stratified along a curve through all texels (Morton 1966), so that each part of the sky is
        drawn as often as it is bright.

        start : number of the first, in a sequence.
        """
        rows, columns, _ = self.picture.shape
        row, column = np.indices((rows, columns)).reshape(2, -1)
        # bits of both in turn: near in this order is near in the sky
        bits = [(bit, 2 * bit) for bit in range(10)]
        curve = sum((row >> a & 1) << b | (column >> a & 1) << (b + 1) for a, b in bits)
        order = np.argsort(curve)
        below = np.cumsum((self.picture.sum(axis=2) * self.areas).ravel()[order])
        inside, across, down = ((0.5 + np.outer(np.arange(start, start + count), _PLASTIC)) % 1.0).T
        places = (np.arange(count) + inside) / count * below[-1]
        kept = order[np.minimum(np.searchsorted(below, places), len(order) - 1)]
        chances = np.diff(below, prepend=0.0)[np.argsort(order)][kept] / below[-1]
        edges = np.cos(np.linspace(0.0, np.pi, rows + 1))
        cosine = edges[row[kept]] + down * np.diff(edges)[row[kept]]
        phi = 2.0 * np.pi * (column[kept] + across) / columns
        return _directions(np.arccos(cosine), phi), chances / self.areas[row[kept], 0]

    def beside_sun(self, directions: Array) -> Array:
        """Unit vectors (n, 3), those that lead to the sun turned aside: to the sky's own light."""
        return _beside(self.sun, directions)

    def packed(self, share: float) -> Packed:
        """For shaders/surroundings.glsl.

        share : of the lights that are drawn from it.
        """
        rows, columns, _ = self.picture.shape
        total = float((self.picture.sum(axis=2) * self.areas).sum())
        four = np.concatenate([self.picture, np.zeros((rows, columns, 1), np.float32)], axis=2)
        cosine = np.cos(_SUN_RADIUS) if self.sun.any() else 2.0
        return Packed(
            (Texture("environment", as_half(four), smooth=True),),
            {
                "environment_density": share / total if total > 0.0 else 0.0,
                "sun": (*self.sun.tolist(), float(cosine)),
                "sun_radiance": tuple(self.sun_radiance.tolist()),
            },
            {"ENVIRONMENT": ""},
        )


def is_flat(shape: Any) -> bool:
    """Whether directions meet a shape exactly."""
    return shape.class_name() in ("Rectangle", "Disk")


def flat_shapes(scene: Any) -> list[Any]:
    """Those of a scene, at most 12, lights first."""
    found = [shape for shape in scene.shapes() if is_flat(shape)]
    return sorted(found, key=lambda shape: not shape.is_emitter())[:_FLATS]


def pack_flats(shapes: Sequence[Any], share_of: Callable[[Any], float]) -> Packed:
    """Rectangles and disks, for shaders/surroundings.glsl.

    share_of : of an emitter, with what probability lights are drawn from it.
    """
    import mitsuba as mi

    if not shapes:
        return Packed(definitions={"FLATS": "0", "DISKS": "0"})
    shapes = sorted(shapes, key=lambda shape: shape.class_name())  # disks first
    rows = np.zeros((4, len(shapes), 4), np.float32)
    for number, shape in enumerate(shapes):
        to_world = np.array(mi.traverse(shape)["to_world"].matrix, np.float64).reshape(4, 4)
        to_local = np.linalg.inv(to_world)
        to_local[2] /= np.linalg.norm(to_local[2, :3])
        if to_local[2, :3] @ a_normal(shape)[1] < 0.0:
            to_local[2] *= -1.0
        rows[:3, number] = to_local[:3]
        if shape.is_emitter():
            area = float(np.array(shape.surface_area()).ravel()[0])
            rows[3, number, :3] = emitted_radiance(shape)
            rows[3, number, 3] = share_of(shape.emitter()) / area
    uniforms: dict[str, Uniform] = dict(
        zip(("flat_x", "flat_y", "flat_z", "flat_light"), rows, strict=True)
    )
    disks = sum(shape.class_name() == "Disk" for shape in shapes)
    return Packed((), uniforms, {"FLATS": str(len(shapes)), "DISKS": str(disks)})


def _directions(theta: Any, phi: Any) -> Array:
    """Unit vectors (..., 3) by angles from the z axis and around it."""
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack(np.broadcast_arrays(x, y, np.cos(theta)), axis=-1)


def _beside(sun: Array, directions: Array) -> Array:
    """Directions (..., 3), those that lead to a sun, if there is one, turned aside."""
    if not sun.any():
        return directions
    aside = sun + np.tan(1.5 * _AROUND_SUN) * frame_along(sun)[0]
    inside = directions @ sun > np.cos(_AROUND_SUN)
    return np.where(inside[..., None], aside / np.linalg.norm(aside), directions)


def _disc(axis: Array, radius: float) -> Array:
    """Unit vectors (64, 3) even over the disc of this angular radius around an axis."""
    number = np.arange(64) + 0.5
    angle, r = 2.399963 * number, np.sqrt(number / 64) * np.tan(radius)  # a sunflower's
    found = axis + np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1) @ frame_along(axis)[:2]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))
