"""A shadow map: how far a light without extent sees the scene, in each direction.

The map covers what the camera sees, not all of the scene: `Casters.seen` finds that out once for a
camera. Lights far away see in parallel, points in perspective. Each map lies a part of a texel
beside the last one, so that the edges of shadows average over frames.

Of a closed surface, the triangles that face away from the light hide all that the others hide, and
none of what is lit lies on them: a map of those alone takes half as long, and what is lit cannot
shade itself. A plane with the light and all of the scene on one side hides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from .camera import Camera, box_corners
from .context import Target, compile_plain, require_moderngl, set_uniforms
from .lights import Light
from .methods import vertex_array
from .scene import Surface
from .texels import Uniform

Array = NDArray[np.float64]

_GLANCES = 192  # pixels along the longer side, to find out what is seen
_SAME = 1e-6  # of the scene's extent: places nearer to each other are one
_BITS = 21  # of a coordinate, in that unit
# texels by which a map's depth may lie before a surface that is lit, at least and at most, and over
# the slope of its normals: within a texel neighbours stand out by as much
_BIAS, _BENT = (0.05, 0.75), 8.0

#: Texels along either side.
SIZE = 1024
_STEEPEST = 16.0  # texels of depth to one across: surfaces more edge-on than 4° are hardly lit
_MARGIN = 1.02  # of the map around what is seen
_WIDEST = 0.1  # cosine from its axis, of what a point sees in one perspective


@dataclass(frozen=True)
class Seen:
    """What a camera sees of a scene."""

    places: Array  # (n, 3) on a coarse grid of pixels
    outline: Array  # (m, 3) those of them that the others lie between
    solid: list[bool]  # of each surface, whether it is a closed body that is seen from outside


@dataclass(frozen=True)
class Solid:
    """What a surface's triangles are as a whole."""

    # low, high: (3,) corners of a box around it
    low: Array
    high: Array
    # 1 of a closed surface whose triangles turn left as seen from outside, −1 if they turn right, 0
    # if it is open
    winding: int
    # (4,) a normal and an offset: all of the scene is on this side of the plane that the surface
    # lies in; None of others
    plane: Array | None
    bias: float  # texels by which it may seem to shade itself

    @classmethod
    def of(cls, triangles: Array, normals: Array, corners: Array) -> Solid:
        """That of triangles (n, 3, 3) in a scene whose places (m, 3) are these or lie between.

        normals : (n, 3, 3) that they are shaded with.
        """
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        bias = float(np.clip(_BENT * _bend(triangles, normals), *_BIAS))
        return cls(low, high, _winding(triangles), _plane(triangles, corners), bias)

    def encloses(self, place: Array) -> bool:
        """Whether a place may lie within it."""
        return bool(np.all((place >= self.low) & (place <= self.high)))

    def hides_nothing(self, light: Light) -> bool:
        """Whether the scene and the light lie on one side of it."""
        return self.plane is not None and float(self.plane @ light.place) > 0.0


class Casters:
    """The scene's triangles, drawn by their places alone.

    buffers : their vertices in the graphics card's memory.
    emitting : those of what emits light and reflects none, which stands in the way of light from
        far away only.
    """

    def __init__(
        self,
        context: Any,
        surfaces: Sequence[Surface],
        buffers: Sequence[Any],
        emitting: Sequence[Any] = (),
    ) -> None:
        self.context = context
        self.program = compile_plain(context, "surface.vert", "position.frag")
        self._arrays = [vertex_array(context, self.program, buffer) for buffer in buffers]
        self._emitting = [vertex_array(context, self.program, buffer) for buffer in emitting]
        vertices = [s.vertices[:, :6].reshape(-1, 3, 6).astype(np.float64) for s in surfaces]
        triangles = [v[..., :3] for v in vertices]
        self._shapes = [int(s.shape.ptr) for s in surfaces]
        hulls = np.concatenate([outline(t.reshape(-1, 3)) for t in triangles])
        self.solids = [Solid.of(v[..., :3], v[..., 3:], hulls) for v in vertices]
        self.low, self.high = hulls.min(axis=0), hulls.max(axis=0)  # corners of a box around all
        self.corners = box_corners(self.low, self.high)

    def draw(self, matrix: Array) -> None:
        """All surfaces, from the scene to clip space by a matrix (4, 4)."""
        moderngl = require_moderngl()
        self.context.enable_only(moderngl.DEPTH_TEST)
        set_uniforms(self.program, {"view_projection": tuple(matrix.T.ravel().tolist())})
        for array in self._arrays:
            array.render(moderngl.TRIANGLES)

    def draw_map(self, matrix: Array, light: Light, seen: Seen) -> list[float]:
        """What a shadow map holds, into the framebuffer in use.

        Returns, of each surface, texels by which what the map holds of it may shade what is lit.
        """
        moderngl = require_moderngl()
        set_uniforms(self.program, {"view_projection": tuple(matrix.T.ravel().tolist())})
        drawn = [
            "none" if shape == light.shape else _needed(solid, light, outside)
            for solid, outside, shape in zip(self.solids, seen.solid, self._shapes, strict=True)
        ]
        for array, solid, part in zip(self._arrays, self.solids, drawn, strict=True):
            if part == "none":
                continue
            # a map looks along its z axis, and so shows its triangles turning the other way
            self.context.cull_face = "back" if solid.winding > 0 else "front"
            culled = moderngl.CULL_FACE if part == "away" else moderngl.NOTHING
            self.context.enable_only(moderngl.DEPTH_TEST | culled)
            array.render(moderngl.TRIANGLES)
        self.context.enable_only(moderngl.DEPTH_TEST)
        if light.place[3] == 0.0:
            for array in self._emitting:
                array.render(moderngl.TRIANGLES)
        return [
            solid.bias if part == "all" else _BIAS[0]
            for solid, part in zip(self.solids, drawn, strict=True)
        ]

    def seen(self, camera: Camera) -> Seen:
        """What a camera sees."""
        longest = max(camera.size)
        width, height = (max(1, round(_GLANCES * n / longest)) for n in camera.size)
        target = Target(self.context, width, height)
        target.frame.use()
        target.frame.clear(0.0, 0.0, 0.0, 0.0)
        self.draw(camera.view_projection(self.low, self.high))
        found = np.frombuffer(target.frame.read(components=4, dtype="f4"), np.float32)
        target.release()
        found = found.reshape(-1, 4).astype(float)
        places = np.asarray(found[found[:, 3] > 0.0, :3], np.float64)
        solid = [s.winding != 0 and not s.encloses(camera.eye) for s in self.solids]
        return Seen(places, outline(places), solid)

    def release(self) -> None:
        for thing in (*self._arrays, *self._emitting, self.program):
            thing.release()


def outline(places: Array) -> Array:
    """Corners of the convex hull of places (n, 3); all of them where they lie in a plane."""
    try:
        return np.asarray(places[ConvexHull(places).vertices])
    except (QhullError, ValueError):
        return np.unique(places, axis=0)


def _needed(solid: Solid, light: Light, from_outside: bool) -> str:
    """Whether a map needs "all" of its triangles, those that face "away" from the light, "none"."""
    if solid.hides_nothing(light):
        return "none"
    inside = light.place[3] > 0.0 and solid.encloses(light.place[:3])
    return "away" if from_outside and not inside else "all"


def _bend(triangles: Array, normals: Array) -> float:
    """Slope by which the normals turn within a triangle, that of the most bent but 1 in 1000."""
    flat = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    along = np.abs(np.einsum("ni,nci->nc", flat, normals))
    across = np.linalg.norm(np.cross(flat[:, None], normals), axis=2)
    slopes = across / np.maximum(along, 1e-30)
    return float(np.quantile(slopes[along.min(axis=1) > 0.0].ravel(), 0.999, method="higher"))


def _winding(triangles: Array) -> int:
    """As of `Solid`: a surface is closed if each edge is passed as often either way."""
    low = triangles.min(axis=(0, 1))
    step = max(float(np.ptp(triangles, axis=(0, 1)).max()), 1e-30) * _SAME
    x, y, z = np.rint((triangles - low) / step).astype(np.int64).transpose(2, 0, 1)
    corner = np.unique((x << _BITS | y) << _BITS | z, return_inverse=True)[1].reshape(-1, 3)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    start, end = start[start != end], end[start != end]
    count = int(corner.max()) + 1
    if not np.array_equal(np.sort(start * count + end), np.sort(end * count + start)):
        return 0
    a, b, c = (triangles - triangles.mean(axis=(0, 1))).transpose(1, 0, 2)
    return int(np.sign(np.einsum("ni,ni->", a, np.cross(b, c))))


def _plane(triangles: Array, corners: Array) -> Array | None:
    """As of `Solid`."""
    places = triangles.reshape(-1, 3)
    sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    largest = sides[np.linalg.norm(sides, axis=1).argmax()]
    normal = largest / max(float(np.linalg.norm(largest)), 1e-300)
    room = _SAME * float(np.ptp(corners, axis=0).max())
    if np.abs((places - places[0]) @ normal).max() > room:
        return None
    above = (corners - places[0]) @ normal
    for sign in (1.0, -1.0):
        if (sign * above).min() >= -room:
            return sign * np.append(normal, -normal @ places[0])
    return None


class ShadowMap:
    """The map of one light after the other.

    size : texels along either side.
    """

    def __init__(self, casters: Casters, size: int = SIZE) -> None:
        self.casters, self.size = casters, size
        context = casters.context
        moderngl = require_moderngl()
        self.texture = context.depth_texture((size, size))
        self.texture.compare_func = ""
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._frame = context.framebuffer(depth_attachment=self.texture)

    def draw(
        self, light: Light, seen: Seen, beside: tuple[float, float]
    ) -> tuple[dict[str, Uniform], list[dict[str, Uniform]]]:
        """Draw what a light sees; what shaders/shadow.glsl reads of it, and of each surface in it.

        seen : what the map must cover.
        beside : 0 to 1, parts of a texel by which the map is shifted.
        """
        if light.place[3] == 0.0:
            corners = self.casters.corners
            matrix, scale = parallel_view(light.place[:3], seen.outline, corners, self.size, beside)
        else:
            matrix, scale = self._perspective(light.place[:3], seen.places, beside)
        self._frame.use()
        self._frame.clear(depth=1.0)
        drawn = self.casters.draw_map(matrix, light, seen)
        cone = (0.0, 0.0)
        if light.cone is not None:
            cone = light.cone[0], 1.0 / max(light.cone[0] - light.cone[1], 1e-6)
        shared: dict[str, Uniform] = {
            "light_axis": tuple(float(x) for x in light.axis),
            "light_cone": cone,
            "shadow_matrix": tuple(matrix.T.ravel().tolist()),
            "shadow_planes": tuple(np.linalg.inv(matrix).ravel().tolist()),
            "shadow_steepest": _STEEPEST * scale,
        }
        return shared, [{"shadow_bias": bias * scale} for bias in drawn]

    def _perspective(
        self, eye: Array, places: Array, beside: tuple[float, float]
    ) -> tuple[Array, float]:
        """Likewise, at the distance 1."""
        away = places - eye
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        mean = away.mean(axis=0)
        axes = frame_along(mean / max(float(np.linalg.norm(mean)), 1e-12))
        ahead = away @ axes[2]
        inside = ahead > _WIDEST
        seen = away[inside] if inside.any() else axes[2:]
        low, high = _bounds(seen @ axes[:2].T / (seen @ axes[2])[:, None], self.size, beside)
        corners = (self.casters.corners - eye) @ axes[2]
        outside = np.maximum(np.maximum(self.casters.low - eye, eye - self.casters.high), 0.0)
        far = max(float(corners.max()) * 1.001, 1e-6)
        # the box lies no nearer than this along the axis of anything within the map
        slant = np.sqrt(1.0 + float((np.maximum(np.abs(low), np.abs(high)) ** 2).sum()))
        nearest = float(np.linalg.norm(outside)) / slant
        near = max(nearest * 0.999, float(corners.min()) * 0.999, 1e-4 * far)
        matrix = np.zeros((4, 4))
        for n in range(2):
            matrix[n, :3] = axes[n] * 2.0 / (high[n] - low[n])
            matrix[n, :3] -= axes[2] * (high[n] + low[n]) / (high[n] - low[n])
        matrix[2, :3] = axes[2] * (far + near) / (far - near)
        matrix[2, 3] = -2.0 * far * near / (far - near)
        matrix[3, :3] = axes[2]
        moved = np.eye(4)
        moved[:3, 3] = -eye
        scale = float((high - low).max()) / self.size * 2.0 * far * near / (far - near)
        return matrix @ moved, scale

    def release(self) -> None:
        self._frame.release()
        self.texture.release()


def parallel_view(
    towards: Array,
    places: Array,
    corners: Array,
    size: int,
    beside: tuple[float, float] = (0.5, 0.5),
) -> tuple[Array, float]:
    """From the scene to clip space, seen in parallel from a direction.

    places, corners : (n, 3) what lies within the map, and between its planes.
    size, beside : texels, and parts of one by which the map is shifted, 0 to 1.

    Returns matrix (4, 4), and the depth in clip space of as much as a texel is wide.
    """
    axes = frame_along(-towards / np.linalg.norm(towards))
    low, high = _bounds(places @ axes[:2].T, size, beside)
    depths = corners @ axes[2]
    near, far = _apart(depths.min(), depths.max())
    matrix = np.eye(4)
    for n in range(2):
        matrix[n, :3] = axes[n] * 2.0 / (high[n] - low[n])
        matrix[n, 3] = -(high[n] + low[n]) / (high[n] - low[n])
    matrix[2, :3] = axes[2] * 2.0 / (far - near)
    matrix[2, 3] = -(far + near) / (far - near)
    return matrix, float((high - low).max()) / size * 2.0 / (far - near)


def frame_along(axis: Array) -> Array:
    """(3, 3) unit vectors, the last of them the axis."""
    first = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])


def _bounds(seen: Array, size: int, beside: tuple[float, float]) -> tuple[Array, Array]:
    """Lowest and highest of coordinates (n, 2), with a margin, shifted by parts of a texel."""
    low, high = seen.min(axis=0), seen.max(axis=0)
    half = 0.5 * np.maximum(high - low, 1e-6 * max(1.0, float(np.abs(seen).max()))) * _MARGIN
    half *= (size + 4.0) / size
    middle = 0.5 * (low + high) + (np.array(beside) - 0.5) * 2.0 * half / size
    return middle - half, middle + half


def _apart(near: float, far: float) -> tuple[float, float]:
    """Planes around a range of depths, not one in the other where it is flat."""
    room = 1e-3 * (far - near) + 1e-6 * max(abs(near), abs(far), 1e-6)
    return near - room, far + room
