"""What a scene is surrounded by, for light that is looked up along directions of a surface's lobes.

Narrow lobes hardly ever meet a light that was drawn without regard to them. So every other frame of
`progressive` draws a direction from the surface's own lobe at each pixel, and looks up what comes
from there: area lights that are flat, and the environment. The two kinds of frames share the light
by the balance heuristic (Veach and Guibas 1995).

What such a direction meets first is exact of rectangles and disks. All else that stands in the way
is found on a grid of distances to the nearest surface: a ray may step as far as that is without
missing one (Hart 1996, *Sphere tracing*).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import distance_transform_edt

from ...errors import DiffractionError
from ...plugin.properties import name_of
from ...tables.colour.build import LARGEST_RADIUS
from ...tables.colour.proposals import IMPORTANCE, brightness
from ...tables.colour.table import ColourTable
from .lights import emitted_radiance, radiance_along
from .scene import a_normal
from .shadows import frame_along
from .texels import Packed, Texture, Uniform, as_half, listed

Array = NDArray[np.float64]

# lobes: cells over (u, v) in rings
_RINGS, _AZIMUTHS, _PLACES = 128, 1024, 1 << 16
_INNERMOST = 0.5  # radius of the innermost cell, in standard deviations of a lobe in the green
_GREEN = 2.0 * np.pi / 0.55  # rad/µm
_ZS = np.array([1.1, 1.45, 1.8])  # of w, from slanted to nearly normal incidence
_EVERYWHERE = 0.1  # share of what is drawn evenly

# the grid of distances
_CELLS = 1 << 22  # in all, about
_MARGIN = 2  # cells around it
_PER_CELL = 4.0  # steps of the distances
_SPACING = 0.7  # cells between two places of a triangle, at most
_AT_ONCE = 1 << 20  # places

_SKY = (128, 256)  # rows and columns of an environment that is no picture, and the fewest of one
_LARGEST = (512, 1024)  # the most
_SUN_RADIUS = np.radians(0.2679)  # as Mitsuba has it
_AROUND_SUN = np.radians(0.6)  # within this, a sky's sun is left to the lights
_FLATS = 12
_PLASTIC = [0.8191725134, 0.6710436067, 0.5497004779]  # steps in three numbers (Roberts 2018)


def pack_lobes(table: ColourTable, height_scale: float) -> Packed:
    """What shaders/lobes.glsl reads.

    height_scale : factor on the heights, the index of a coat included.
    """
    smallest = _INNERMOST / (np.sqrt(2.0) * _GREEN * table.sigma)
    step = np.log(LARGEST_RADIUS / smallest) / (_RINGS - 1)
    edges = np.concatenate([[0.0], smallest * np.exp(step * np.arange(_RINGS))])
    areas = np.diff(edges**2)[:, None] * np.full(_AZIMUTHS, np.pi / _AZIMUTHS)
    power = _power(table, edges, height_scale)
    share = power / max(float(power.sum()), 1e-30)
    share = (1.0 - _EVERYWHERE) * share + _EVERYWHERE * areas / areas.sum()
    return Packed(
        (
            Texture("lobe_densities", (share / areas)[..., None].astype(np.float32)),
            listed("lobe_places", _lobe_places(share, edges)),
        ),
        {"lobe_smallest": float(smallest), "lobe_step": float(step)},
        {"LOBE_PLACES": str(_PLACES)},
    )


def _power(
    table: ColourTable, edges: NDArray[np.float64], height_scale: float
) -> NDArray[np.float64]:
    """Brightness in the cells (rings, azimuths) between these radii."""
    zs = np.minimum(_ZS * height_scale, table.z_max)
    grid, bright = table.grid, brightness(table, zs) / len(zs)
    cells = np.zeros((_RINGS, _AZIMUTHS))
    for ring, count in enumerate(grid.counts):
        radius = grid.radius(ring)
        row = int(np.clip(np.searchsorted(edges, radius) - 1, 0, _RINGS - 1))
        start = grid.start(ring)
        area = radius**2 * grid.step * 2.0 * np.pi / count
        parts = 2 * max(1, _AZIMUTHS // count)  # of a bin, which lies on both sides of its azimuth
        spread = np.repeat(bright[start : start + count], parts) * (area / parts)
        turn = np.arange(len(spread)) * _AZIMUTHS // len(spread)
        cells[row] += np.bincount(turn, np.roll(spread, -parts // 2), _AZIMUTHS)
    radii = np.linspace(0.0, table.radius_end, len(table.order_0))
    places = np.rint(zs / table.z_max * (table.order_0.shape[1] - 1)).astype(int)
    profile = np.maximum(table.order_0[:, places, :3] @ np.array(IMPORTANCE), 0.0).mean(axis=1)
    within = cumulative_trapezoid(2.0 * np.pi * radii * profile, radii, initial=0.0)
    return cells + np.diff(np.interp(edges, radii, within))[:, None] / _AZIMUTHS


def _lobe_places(share: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float32]:
    """(u, v) as often in each cell as it is drawn, in the cells' order, (n, 2)."""
    below = np.concatenate([[0.0], np.cumsum(share)])
    wanted = (np.arange(_PLACES) + 0.5) / _PLACES * below[-1]
    cell = np.minimum(np.searchsorted(below, wanted, side="right") - 1, share.size - 1)
    inside = (wanted - below[cell]) / (below[cell + 1] - below[cell])
    ring, azimuth = np.divmod(cell, _AZIMUTHS)
    across = np.arange(_PLACES) * 0.6180339887 % 1.0
    radius = np.sqrt(edges[ring] ** 2 + (edges[ring + 1] ** 2 - edges[ring] ** 2) * across)
    phi = 2.0 * np.pi * (azimuth + inside) / _AZIMUTHS
    return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=1).astype(np.float32)


def pack_obstacles(triangles: Array) -> Packed:
    """What shaders/obstacles.glsl reads of triangles (n, 3, 3)."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    # flat or thin, a scene gets some room
    room = np.maximum(high - low, max(float((high - low).max()), 1e-12) / 64.0)
    cell = float((room.prod() / _CELLS) ** (1.0 / 3.0))
    low = low - _MARGIN * cell
    size = np.ceil((high - low) / cell).astype(int) + _MARGIN
    empty = np.ones(size[::-1], bool)
    for places in _places((triangles - low) / cell):
        x, y, z = places.astype(np.int32).T
        empty[z, y, x] = False
    apart = distance_transform_edt(empty)
    steps = np.minimum(np.floor(_PER_CELL * apart), 255.0).astype(np.uint8)
    return Packed(
        (listed("obstacles", steps.reshape(-1, 1)),),
        {
            "obstacles_low": tuple(low.tolist()),
            "obstacles_cell": cell,
            "obstacles_size": tuple(size.tolist()),
        },
        {"OBSTACLES": str(255.0 / _PER_CELL)},
    )


def _places(triangles: Array) -> Iterator[Array]:
    """Places (n, 3) all over triangles (n, 3, 3), in cells, some at a time."""
    sides = triangles - np.roll(triangles, 1, axis=1)
    longest = np.sqrt((sides**2).sum(axis=2).max(axis=1))
    parts = np.maximum(np.ceil(longest / _SPACING), 1.0).astype(int)
    parts = 2 ** np.ceil(np.log2(parts)).astype(int)  # few kinds
    for count in np.unique(parts):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
        kept = i + j <= count
        weights = np.stack([i[kept], j[kept], count - i[kept] - j[kept]], axis=1) / count
        chosen = triangles[parts == count]
        step = max(1, _AT_ONCE // len(weights))
        for start in range(0, len(chosen), step):
            yield np.einsum("wc,ncx->nwx", weights, chosen[start : start + step]).reshape(-1, 3)


@dataclass(frozen=True)
class Environment:
    """Radiance from infinitely far away."""

    emitter: Any  # of Mitsuba
    # (rows, columns, 3) linear sRGB without the sun's disc, rows over the angle from the z axis,
    # columns around it
    picture: NDArray[np.float32]
    sun: Array  # (3,) the direction towards its middle, or zeros
    sun_radiance: Array  # (3,) linear sRGB, the mean over the disc

    @classmethod
    def of(cls, scene: Any) -> Environment | None:
        """Of a Mitsuba scene, if it has one.

        Raises a DiffractionError if it is not finite.
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
