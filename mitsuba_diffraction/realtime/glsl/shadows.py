"""Shadow maps: distance from a point or directional light to the nearest surface.

A map covers the part of the scene that the camera sees. Directional lights have parallel
projections, points have perspective ones. Each map is shifted by a part of a texel, so that the
edges of shadows average over frames.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...arrays import Real
from .camera import Camera, box_corners
from .context import (
    Bindings,
    Resources,
    Target,
    VertexBuffer,
    compile_program,
    enable_sides,
    set_uniforms,
)
from .lights import Lamp
from .scene import RealtimeScene, SceneSurface
from .source import source_parts
from .texels import Packed, Uniform

_GLANCES = 192  # pixels along the longer side of the picture that determines the visible part
_BIAS = 0.75  # depth bias, texels: neighbouring triangles differ in slope

#: Texels a side of a shadow map.
SIZE = 1024
_STEEPEST = 16.0  # largest slope, texels of depth per texel: surfaces within 4° of edge-on are dark
_MARGIN = 1.02  # size of the map relative to the visible part
_WIDEST = 0.1  # least cosine from the axis of a point light's perspective


class ShadowMap(Resources):
    """Shadow map of the places that a camera sees, which is redrawn for each light.

    buffers : vertex buffers of the scene's surfaces.
    size : texels a side.
    """

    def __init__(
        self, context: Any, scene: RealtimeScene, buffers: Sequence[VertexBuffer], camera: Camera,
        size: int = SIZE,
    ) -> None:  # fmt: skip
        self._context, self._scene, self._size = context, scene, size
        self._camera = np.append(camera.eye, 1.0)
        parts = source_parts(["position.frag"])
        self._program = self.own(compile_program(context, "shadow maps", parts))
        self._arrays = [self.own(buffer.array(self._program)) for buffer in buffers]
        self._corners = box_corners(scene.low, scene.high)
        self._texture = self.own(context.depth_texture((size, size)))
        self._texture.compare_func = ""
        self._texture.filter = (context.NEAREST, context.NEAREST)
        self._frame = self.own(context.framebuffer(depth_attachment=self._texture))
        self._visible = self._seen_by(camera)

    def _seen_by(self, camera: Camera) -> Real:
        """Return places (n, 3) that a camera sees, or corners of the scene where it sees none."""
        scale = _GLANCES / max(camera.size)
        target = Target(self._context, *(max(1, round(scale * n)) for n in camera.size))
        matrix = camera.view_projection(self._scene.low, self._scene.high)
        self._draw(target.frame, matrix, lambda one: None if one.lamp else 0)
        pixels = target.read().reshape(-1, 4).astype(float)
        target.release()
        places = pixels[pixels[:, 3] > 0.0, :3]
        return places if len(places) else self._corners

    def _draw(self, frame: Any, matrix: Real, sides: Callable[[SceneSurface], int | None]) -> None:
        """Draw with a matrix (4, 4) from the scene to clip space.

        sides : of each surface, as of `enable_sides`, or None to leave it out.
        """
        frame.use()
        frame.clear()
        set_uniforms(self._program, {"view_projection": tuple(matrix.T.ravel().tolist())})
        for surface, array in zip(self._scene.surfaces, self._arrays, strict=True):
            if (winding := sides(surface)) is not None:
                enable_sides(self._context, winding)
                array.render()

    def draw(self, light: Lamp, shift: Real) -> Bindings:
        """Draw the map of a light, and return the part of shaders/shadow.glsl.

        Lamps shade directional lights alone, and no shape its own light.

        shift : (2,) displacement of the map in texels, 0 to 1.
        """
        view = self._perspective if light.place[3] else self._parallel
        matrix, scale = view(light.place[:3], shift)

        def sides(one: SceneSurface) -> int | None:
            if one.shape.ptr == light.shape or (one.lamp and light.place[3]):
                return None
            # the map looks along its z axis, which reverses the triangles' orientation: triangles
            # that face away from the light hide all that the others hide
            return one.winding_from(self._camera) and one.winding_from(light.place)

        self._draw(self._frame, matrix, sides)
        cone = (0.0, 0.0)
        if light.cone is not None:
            cone = light.cone[0], 1.0 / max(light.cone[0] - light.cone[1], 1e-6)
        uniforms: dict[str, Uniform] = {
            "light_axis": tuple(float(x) for x in light.axis),
            "light_cone": cone,
            "shadow_matrix": tuple(matrix.T.ravel().tolist()),
            "shadow_planes": tuple(np.linalg.inv(matrix).ravel().tolist()),
            "shadow_bias": _BIAS * scale,
            "shadow_steepest": _STEEPEST * scale,
        }
        bindings = Bindings(self._context, Packed((), uniforms, {"SHADOWED": ""}))
        bindings.textures["shadow_map"] = self._texture
        return bindings

    def _perspective(self, eye: Real, shift: Real) -> tuple[Real, float]:
        """Return the perspective view from a point, as `_parallel`, its scale at distance 1."""
        away = self._visible - eye
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        middle = away.min(axis=0) + away.max(axis=0)
        axes = frame_along(middle / max(float(np.linalg.norm(middle)), 1e-12))
        inside = away @ axes[2] > _WIDEST
        covered = away[inside] if inside.any() else axes[2:]
        projected = covered @ axes[:2].T / (covered @ axes[2])[:, None]
        low, high = self._bounds(projected, shift)
        depths = (self._corners - eye) @ axes[2]
        outside = np.maximum(np.maximum(self._scene.low - eye, eye - self._scene.high), 0.0)
        far = max(float(depths.max()) * 1.001, 1e-6)
        # least depth of the box along the axis within the map
        slant = np.sqrt(1.0 + float((np.maximum(np.abs(low), np.abs(high)) ** 2).sum()))
        nearest = float(np.linalg.norm(outside)) / slant
        near = max(nearest * 0.999, float(depths.min()) * 0.999, 1e-4 * far)
        matrix = np.zeros((4, 4))
        sides, sums = (high - low)[:, None], (high + low)[:, None]
        matrix[:2, :3] = axes[:2] * 2.0 / sides - axes[2] * sums / sides
        matrix[2, :3] = axes[2] * (far + near) / (far - near)
        matrix[2, 3] = -2.0 * far * near / (far - near)
        matrix[3, :3] = axes[2]
        matrix[:, 3] -= matrix[:, :3] @ eye
        scale = float((high - low).max()) / self._size * 2.0 * far * near / (far - near)
        return matrix, scale

    def _parallel(self, towards: Real, shift: Real) -> tuple[Real, float]:
        """Return the parallel view of the scene from a direction.

        Returns the matrix (4, 4) from the scene to clip space, and the depth there that equals the
        width of a texel.
        """
        axes = frame_along(-towards / np.linalg.norm(towards))
        low, high = self._bounds(self._visible @ axes[:2].T, shift)
        depths = self._corners @ axes[2]
        near, far = depths.min(), depths.max()
        # distinct planes even around an empty range of depths
        room = 1e-3 * (far - near) + 1e-6 * max(abs(near), abs(far), 1e-6)
        near, far = near - room, far + room
        matrix = np.eye(4)
        matrix[:2, :3] = axes[:2] * 2.0 / (high - low)[:, None]
        matrix[:2, 3] = -(high + low) / (high - low)
        matrix[2, :3] = axes[2] * 2.0 / (far - near)
        matrix[2, 3] = -(far + near) / (far - near)
        return matrix, float((high - low).max()) / self._size * 2.0 / (far - near)

    def _bounds(self, points: Real, shift: Real) -> tuple[Real, Real]:
        """Return the bounds of coordinates (n, 2), with a margin, shifted by parts of a texel."""
        low, high = points.min(axis=0), points.max(axis=0)
        half = 0.5 * np.maximum(high - low, 1e-6 * max(1.0, float(np.abs(points).max()))) * _MARGIN
        half *= (self._size + 4.0) / self._size
        middle = 0.5 * (low + high) + (shift - 0.5) * 2.0 * half / self._size
        return middle - half, middle + half


def frame_along(axis: Real) -> Real:
    """Return an orthonormal frame (3, 3) whose last row is the axis."""
    first = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])
