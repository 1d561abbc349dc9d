"""A shadow map: how far a light without extent sees the scene, in each direction.

The map covers what the camera sees, not all of the scene: `Casters.seen` finds that out once for a
camera. Lights far away see in parallel, points in perspective. Each map lies a part of a texel
beside the last one, so that the edges of shadows average over frames.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .casters import Casters, Seen
from .context import require_moderngl
from .lights import Light
from .texels import Uniform

Array = NDArray[np.float64]

#: Texels along either side.
SIZE = 1024

_STEEPEST = 16.0  # texels of depth to one across: surfaces more edge-on than 4° are hardly lit
_MARGIN = 1.02  # of the map around what is seen
_WIDEST = 0.1  # cosine from its axis, of what a point sees in one perspective


class ShadowMap:
    """The map of one light after the other.

    Parameters
    ----------
    casters : what casts shadows.
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

        Parameters
        ----------
        light : without extent.
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
        """Free the graphics card's memory."""
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

    Parameters
    ----------
    towards : (3,) the direction.
    places, corners : (n, 3) what lies within the map, and between its planes.
    size, beside : texels, and parts of one by which the map is shifted, 0 to 1.

    Returns
    -------
    matrix (4, 4), and the depth in clip space of as much as a texel is wide.
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
