"""Surroundings of a scene, which shaders look up along directions drawn from a surface's lobes.

Lights that are drawn independently of a surface rarely lie in a narrow lobe. So every other frame
of progressive light draws a direction from the surface's lobe at each pixel, and looks up the light
from that direction: flat area lights, and the environment. The balance heuristic (Veach and Guibas
1995) weights the two kinds of frames.

Rays intersect rectangles and disks exactly. Other obstacles are tested on a grid of distances to
the nearest surface: a ray can step by that distance without missing one (Hart 1996, *Sphere
tracing*).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...analysis.maps.hemisphere import polar
from ...arrays import Real
from ...errors import DiffractionError
from ...scene.elements import name_of
from .lights import AROUND_SUN, area_of, emitted_radiance, radiance_along, sun_of
from .scene import sample_normal
from .shadows import frame_along
from .texels import Packed, Texture, Uniform, as_half, four_channels, pack_grid

# grid of distances
_CELLS = 1 << 22  # approximate number of cells
_MARGIN = 2  # cells around the obstacles
_PER_CELL = 4.0  # distance steps per cell
_SPACING = 0.7  # largest distance between two points of a triangle, cells
_AT_ONCE = 1 << 20  # points at a time

_SKY = (128, 256)  # rows and columns of an environment without a picture, and the fewest of one
_LARGEST = (512, 1024)  # most rows and columns
_SUN_RADIUS = np.radians(0.2679)  # Mitsuba's radius of the sun
_FLATS = 12  # largest number of flat shapes


def pack_obstacles(triangles: Real) -> Packed:
    """Pack the grid of distances to triangles (n, 3, 3), for shaders/obstacles.glsl."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    # flat or thin scenes get a minimum thickness
    room = np.maximum(high - low, max(float((high - low).max()), 1e-12) / 64.0)
    cell = float((room.prod() / _CELLS) ** (1.0 / 3.0))
    low = low - _MARGIN * cell
    size = np.ceil((high - low) / cell).astype(int) + _MARGIN
    empty = np.ones(size[::-1], bool)
    for places in _places((triangles - low) / cell):
        x, y, z = places.astype(np.int32).T
        empty[z, y, x] = False
    distances = scipy.ndimage.distance_transform_edt(empty)
    steps = np.minimum(np.floor(_PER_CELL * distances), 255.0).astype(np.uint8)
    packed = pack_grid("obstacles", steps.reshape(-1, 1), low, cell, size)
    return packed | Packed(definitions={"OBSTACLES": str(255.0 / _PER_CELL)})


def _places(triangles: Real) -> Iterator[Real]:
    """Yield points (n, 3) all over triangles (n, 3, 3), in units of cells, some at a time."""
    sides = triangles - np.roll(triangles, 1, axis=1)
    longest = np.sqrt((sides**2).sum(axis=2).max(axis=1))
    parts = np.maximum(np.ceil(longest / _SPACING), 1.0).astype(int)
    parts = 2 ** np.ceil(np.log2(parts)).astype(int)  # powers of 2: few different subdivisions
    for count in np.unique(parts):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
        inner = i + j <= count
        weights = np.stack([i[inner], j[inner], count - i[inner] - j[inner]], axis=1) / count
        chosen = triangles[parts == count]
        step = max(1, _AT_ONCE // len(weights))
        for start in range(0, len(chosen), step):
            yield (weights @ chosen[start : start + step]).reshape(-1, 3)


@dataclass(frozen=True)
class Environment:
    """Radiance from infinitely far away, by direction."""

    emitter: Any  # emitter of Mitsuba
    # (rows, columns, 3) linear sRGB without the sun's disc, rows over the angle from the z axis,
    # columns around it
    picture: NDArray[np.float32]
    sun: Real  # (3,) direction towards the middle of the sun, or zeros
    sun_radiance: Real  # (3,) linear sRGB, mean over the sun's disc

    @classmethod
    def read(cls, scene: Any) -> Environment | None:
        """Read the environment of a Mitsuba scene, or return None without one.

        Raises a DiffractionError if a radiance is not finite.
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
        directions = polar(*np.broadcast_arrays(theta, phi))
        sun, radiance = sun_of(emitter), np.zeros(3)
        if sun.any():
            directions = _beside(sun, directions)
            radiance = radiance_along(emitter, _disc(sun, _SUN_RADIUS)).mean(axis=0)
        with np.errstate(invalid="ignore"):
            picture = radiance_along(emitter, directions.reshape(-1, 3))
        if not (np.isfinite(picture).all() and np.isfinite(radiance).all()):
            raise DiffractionError(
                f"{name_of(emitter)}: the environment has infinite or NaN radiances; "
                "use a picture without them"
            )
        picture = picture.reshape(rows, columns, 3)
        return cls(emitter, np.maximum(picture, 0.0).astype(np.float32), sun, radiance)

    def in_sun(self, directions: Real) -> NDArray[np.bool_]:
        """Return which of (n, 3) unit vectors point to the sun, as a mask."""
        return np.asarray(directions @ self.sun > np.cos(AROUND_SUN))

    @property
    def total(self) -> float:
        """Radiance of all channels over the whole sphere."""
        rows, columns, _ = self.picture.shape
        bands = -np.diff(np.cos(np.linspace(0.0, np.pi, rows + 1))) * 2.0 * np.pi / columns
        return float(bands @ self.picture.sum(axis=(1, 2)))

    def density(self, directions: Real) -> Real:
        """Return the probability density (n,) of drawn unit vectors (n, 3) per solid angle.

        It follows the picture interpolated between texels, which shaders look up along lobes.
        """
        rows, columns, _ = self.picture.shape
        theta = np.arccos(np.clip(directions[:, 2], -1.0, 1.0))
        phi = np.arctan2(directions[:, 1], directions[:, 0]) % (2.0 * np.pi)
        around = np.pad(self.picture.sum(axis=2), [(0, 0), (1, 1)], mode="wrap")
        place = [rows * theta / np.pi - 0.5, columns * phi / (2.0 * np.pi) + 0.5]
        found = scipy.ndimage.map_coordinates(around, place, np.float64, order=1, mode="nearest")
        return np.asarray(found / max(self.total, 1e-30))

    def packed(self, share: float) -> Packed:
        """Pack the environment for shaders/surroundings.glsl.

        share : probability of lights drawn from the environment.
        """
        cosine = np.cos(_SUN_RADIUS) if self.sun.any() else 2.0
        return Packed(
            (Texture("environment", as_half(four_channels(self.picture)), smooth=True),),
            {
                "environment_density": share / self.total if self.total > 0.0 else 0.0,
                "sun": (*self.sun.tolist(), float(cosine)),
                "sun_radiance": tuple(self.sun_radiance.tolist()),
            },
            {"ENVIRONMENT": ""},
        )


def is_flat(shape: Any) -> bool:
    """Return whether rays intersect a shape exactly: a rectangle or a disk."""
    return shape.class_name() in ("Rectangle", "Disk")


def flat_shapes(scene: Any) -> list[Any]:
    """Return the rectangles and disks of a scene, at most 12, emitters first."""
    flats = [shape for shape in scene.shapes() if is_flat(shape)]
    return sorted(flats, key=lambda shape: not shape.is_emitter())[:_FLATS]


def pack_flats(shapes: Sequence[Any], share_of: Callable[[Any], float]) -> Packed:
    """Pack rectangles and disks for shaders/surroundings.glsl.

    share_of : function that returns the probability of lights drawn from an emitter.
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
        if to_local[2, :3] @ sample_normal(shape)[1] < 0.0:
            to_local[2] *= -1.0
        rows[:3, number] = to_local[:3]
        if shape.is_emitter():
            area = area_of(shape)
            rows[3, number, :3] = emitted_radiance(shape)
            rows[3, number, 3] = share_of(shape.emitter()) / area
    uniforms: dict[str, Uniform] = dict(
        zip(("flat_x", "flat_y", "flat_z", "flat_light"), rows, strict=True)
    )
    disks = sum(shape.class_name() == "Disk" for shape in shapes)
    return Packed((), uniforms, {"FLATS": str(len(shapes)), "DISKS": str(disks)})


def _beside(sun: Real, directions: Real) -> Real:
    """Turn unit vectors (..., 3) that point to the sun aside, to the sky's light alone."""
    aside = sun + np.tan(1.5 * AROUND_SUN) * frame_along(sun)[0]
    inside = directions @ sun > np.cos(AROUND_SUN)
    return np.where(inside[..., None], aside / np.linalg.norm(aside), directions)


def _disc(axis: Real, radius: float) -> Real:
    """Return unit vectors (64, 3), even over the disc of this angular radius around an axis."""
    number = np.arange(64) + 0.5
    angle, r = 2.399963 * number, np.sqrt(number / 64) * np.tan(radius)  # sunflower spiral
    offsets = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1) @ frame_along(axis)[:2]
    directions = axis + offsets
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))
