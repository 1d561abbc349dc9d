"""Shadow maps: distance from a point or directional light to the nearest surface.

A map covers the part of the scene that the camera sees, which `Casters.visible` determines once for
a camera. Directional lights have parallel projections, points have perspective ones. Each map is
shifted by a part of a texel, so that the edges of shadows average over frames.

Of a closed surface, only the triangles that face away from the light are drawn. They hide all that
the others hide: drawing costs half as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ...arrays import Real
from .camera import Camera, box_corners
from .context import Resources, Target, VertexBuffer, compile_program, enable_sides, set_uniforms
from .lights import Lamp
from .scene import RealtimeScene
from .source import source_parts
from .texels import Uniform

_GLANCES = 192  # pixels along the longer side of the picture that determines the visible part
_SAME = 1e-6  # distance of points that are equal, relative to the scene's extent
_BITS = 21  # bits of a coordinate in units of that distance
_BIAS = 0.75  # depth bias, texels: neighbouring triangles differ in slope

#: Texels a side of a shadow map.
SIZE = 1024
_STEEPEST = 16.0  # largest slope, texels of depth per texel: surfaces within 4° of edge-on are dark
_MARGIN = 1.02  # size of the map relative to the visible part
_WIDEST = 0.1  # least cosine from the axis of a point light's perspective


@dataclass(frozen=True)
class Visible:
    """Part of a scene that a camera sees."""

    places: Real  # (n, 3) visible points, on a coarse grid of pixels
    outline: Real  # (m, 3) corners of their convex hull
    windings: list[int]  # of each closed surface that is seen from outside; 0 for others


@dataclass(frozen=True)
class Solid:
    """Extent and orientation of a surface's triangles."""

    low: Real  # (3,) lowest corner of a box around the surface
    high: Real  # (3,) highest corner
    # 1: closed, and triangles are counter-clockwise from outside; −1: clockwise; 0: open
    winding: int

    @classmethod
    def analyse(cls, triangles: Real) -> Solid:
        """Analyse triangles (n, 3, 3)."""
        return cls(triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1)), _winding(triangles))

    def from_outside(self, place: Real) -> int:
        """Return the winding, 0 if a place (position and 1, or direction and 0) is in the box."""
        inside = (place[:3] >= self.low) & (place[:3] <= self.high)
        return 0 if place[3] and inside.all() else self.winding


class Casters(Resources):
    """Triangles of a scene that cast shadows, drawn by their positions alone.

    buffers : vertex buffers of the surfaces.
    """

    def __init__(self, context: Any, scene: RealtimeScene, buffers: Sequence[VertexBuffer]) -> None:
        self.context, self._surfaces = context, scene.surfaces
        parts = source_parts(["position.frag"])
        self.program = self.own(compile_program(context, "shadow maps", parts))
        self._arrays = [self.own(buffer.array(self.program)) for buffer in buffers]
        corners = (s.vertices[:, :3].reshape(-1, 3, 3).astype(np.float64) for s in scene.surfaces)
        self.solids = [Solid.analyse(triangles) for triangles in corners]
        self.low, self.high = scene.low, scene.high
        self.corners = box_corners(scene.low, scene.high)

    def draw(self, matrix: Real) -> None:
        """Draw what reflects light, with a matrix (4, 4) from the scene to clip space."""
        parts = [None if surface.lamp else 0 for surface in self._surfaces]
        self._draw(matrix, parts)

    def draw_map(self, matrix: Real, light: Lamp, visible: Visible) -> None:
        """Draw a shadow map; lamps shade directional lights alone, and no shape its own."""
        parts: list[int | None] = []
        for surface, solid, winding in zip(
            self._surfaces, self.solids, visible.windings, strict=True
        ):
            shades = surface.shape.ptr != light.shape and not (surface.lamp and light.place[3])
            # the map looks along its z axis, which reverses the triangles' orientation
            parts.append((winding and solid.from_outside(light.place)) if shades else None)
        self._draw(matrix, parts)

    def _draw(self, matrix: Real, windings: Sequence[int | None]) -> None:
        """Draw surfaces by their windings as of `enable_sides`, and leave out those with None."""
        set_uniforms(self.program, {"view_projection": tuple(matrix.T.ravel().tolist())})
        for array, winding in zip(self._arrays, windings, strict=True):
            if winding is not None:
                enable_sides(self.context, winding)
                array.render()

    def visible(self, camera: Camera) -> Visible:
        """Determine the part of the scene that a camera sees, or the scene where it sees none."""
        longest = max(camera.size)
        width, height = (max(1, round(_GLANCES * n / longest)) for n in camera.size)
        target = Target(self.context, width, height)
        target.frame.use()
        target.frame.clear(0.0, 0.0, 0.0, 0.0)
        self.draw(camera.view_projection(self.low, self.high))
        pixels = target.read()[::-1].reshape(-1, 4).astype(float)
        target.release()
        places = np.asarray(pixels[pixels[:, 3] > 0.0, :3], np.float64)
        places = places if len(places) else self.corners
        eye = np.append(camera.eye, 1.0)
        return Visible(places, outline(places), [s.from_outside(eye) for s in self.solids])


def outline(places: Real) -> Real:
    """Return the corners of the convex hull of points (n, 3), or all points of a flat set."""
    try:
        return np.asarray(places[scipy.spatial.ConvexHull(places).vertices])
    except (scipy.spatial.QhullError, ValueError):
        return np.unique(places, axis=0)


def _winding(triangles: Real) -> int:
    """Return `Solid.winding`: closed if each edge is traversed equally often in both directions."""
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


class ShadowMap(Resources):
    """Shadow map, which is redrawn for each light.

    size : texels a side.
    """

    def __init__(self, casters: Casters, size: int = SIZE) -> None:
        self.casters, self.size = casters, size
        context = casters.context
        self.texture = self.own(context.depth_texture((size, size)))
        self.texture.compare_func = ""
        self.texture.filter = (context.NEAREST, context.NEAREST)
        self._frame = self.own(context.framebuffer(depth_attachment=self.texture))

    def draw(self, light: Lamp, visible: Visible, shift: tuple[float, float]) -> dict[str, Uniform]:
        """Draw the map of a light, and return uniforms of shaders/shadow.glsl.

        visible : part of the scene that the map covers.
        shift : displacement of the map in texels, 0 to 1.
        """
        if light.place[3] == 0.0:
            matrix, scale = parallel_view(
                light.place[:3], visible.outline, self.casters.corners, self.size, shift
            )
        else:
            matrix, scale = self._perspective(light.place[:3], visible, shift)
        self._frame.use()
        self._frame.clear(depth=1.0)
        self.casters.draw_map(matrix, light, visible)
        cone = (0.0, 0.0)
        if light.cone is not None:
            cone = light.cone[0], 1.0 / max(light.cone[0] - light.cone[1], 1e-6)
        return {
            "light_axis": tuple(float(x) for x in light.axis),
            "light_cone": cone,
            "shadow_matrix": tuple(matrix.T.ravel().tolist()),
            "shadow_planes": tuple(np.linalg.inv(matrix).ravel().tolist()),
            "shadow_bias": _BIAS * scale,
            "shadow_steepest": _STEEPEST * scale,
        }

    def _perspective(
        self, eye: Real, visible: Visible, shift: tuple[float, float]
    ) -> tuple[Real, float]:
        """Return the perspective view from a point, as `parallel_view`, its scale at distance 1."""
        for places in (visible.outline, visible.places):  # corners suffice if all lie ahead
            away = places - eye
            away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
            mean = away.mean(axis=0)
            axes = frame_along(mean / max(float(np.linalg.norm(mean)), 1e-12))
            inside = away @ axes[2] > _WIDEST
            if inside.all():
                break
        covered = away[inside] if inside.any() else axes[2:]
        projected = covered @ axes[:2].T / (covered @ axes[2])[:, None]
        low, high = _bounds(projected, self.size, shift)
        corners = (self.casters.corners - eye) @ axes[2]
        outside = np.maximum(np.maximum(self.casters.low - eye, eye - self.casters.high), 0.0)
        far = max(float(corners.max()) * 1.001, 1e-6)
        # least depth of the box along the axis within the map
        slant = np.sqrt(1.0 + float((np.maximum(np.abs(low), np.abs(high)) ** 2).sum()))
        nearest = float(np.linalg.norm(outside)) / slant
        near = max(nearest * 0.999, float(corners.min()) * 0.999, 1e-4 * far)
        matrix = np.zeros((4, 4))
        sides, sums = (high - low)[:, None], (high + low)[:, None]
        matrix[:2, :3] = axes[:2] * 2.0 / sides - axes[2] * sums / sides
        matrix[2, :3] = axes[2] * (far + near) / (far - near)
        matrix[2, 3] = -2.0 * far * near / (far - near)
        matrix[3, :3] = axes[2]
        moved = np.eye(4)
        moved[:3, 3] = -eye
        scale = float((high - low).max()) / self.size * 2.0 * far * near / (far - near)
        return matrix @ moved, scale


def parallel_view(
    towards: Real,
    places: Real,
    corners: Real,
    size: int,
    shift: tuple[float, float] = (0.5, 0.5),
) -> tuple[Real, float]:
    """Return the parallel view of a scene from a direction.

    Returns the matrix (4, 4) from the scene to clip space, and the depth there that equals the
    width of a texel.

    places : (n, 3) points within the map.
    corners : (m, 3) points between the near and the far plane.
    size, shift : texels a side, and displacement of the map in texels, 0 to 1.
    """
    axes = frame_along(-towards / np.linalg.norm(towards))
    low, high = _bounds(places @ axes[:2].T, size, shift)
    depths = corners @ axes[2]
    near, far = depths.min(), depths.max()
    # distinct planes even around an empty range of depths
    room = 1e-3 * (far - near) + 1e-6 * max(abs(near), abs(far), 1e-6)
    near, far = near - room, far + room
    matrix = np.eye(4)
    matrix[:2, :3] = axes[:2] * 2.0 / (high - low)[:, None]
    matrix[:2, 3] = -(high + low) / (high - low)
    matrix[2, :3] = axes[2] * 2.0 / (far - near)
    matrix[2, 3] = -(far + near) / (far - near)
    return matrix, float((high - low).max()) / size * 2.0 / (far - near)


def frame_along(axis: Real) -> Real:
    """Return an orthonormal frame (3, 3) whose last row is the axis."""
    first = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])


def _bounds(points: Real, size: int, shift: tuple[float, float]) -> tuple[Real, Real]:
    """Return the bounds of coordinates (n, 2), with a margin, shifted by parts of a texel."""
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.5 * np.maximum(high - low, 1e-6 * max(1.0, float(np.abs(points).max()))) * _MARGIN
    half *= (size + 4.0) / size
    middle = 0.5 * (low + high) + (np.array(shift) - 0.5) * 2.0 * half / size
    return middle - half, middle + half
