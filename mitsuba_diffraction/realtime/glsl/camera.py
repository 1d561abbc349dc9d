"""Cameras of OpenGL from Mitsuba's sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...arrays import Real
from ...errors import DiffractionError


@dataclass(frozen=True)
class Camera:
    """Perspective camera, a pinhole or a thin lens."""

    to_world: Real  # (4, 4); the camera looks along its z axis, y is up and x to the left
    fov: float  # angle of view across the picture, degrees
    size: tuple[int, int]  # width and height, pixels
    offset: tuple[float, float] = (0.0, 0.0)  # principal point's offset, in widths and heights
    lens: float = 0.0  # radius of the lens
    focus: float = 1.0  # distance of the plane in focus

    @property
    def eye(self) -> Real:
        """Position of the camera (3,)."""
        return self.to_world[:3, 3]

    def resized(self, width: int, height: int) -> Camera:
        """Return this camera with a picture of another size."""
        return replace(self, size=(width, height))

    def sampled(self, pixel: Real, lens: Real) -> Camera:
        """Return the pinhole camera through one point of each pixel and of the lens.

        pixel : (2,) offset from the middle of the pixel, −1/2 to 1/2.
        lens : (2,) 0 to 1, mapped evenly to the lens.
        """
        width, height = self.size
        radius, turn = self.lens * np.sqrt(lens[0]), 2.0 * np.pi * lens[1]
        beside = radius * np.array([np.cos(turn), np.sin(turn)])
        moved = self.to_world.copy()
        moved[:3, 3] += moved[:3, :2] @ beside
        # points in focus do not move in the picture
        shift = beside / (2.0 * self.focus * np.tan(np.radians(0.5 * self.fov)))
        offset = (
            self.offset[0] + pixel[0] / width - shift[0],
            self.offset[1] + pixel[1] / height - shift[1] * width / height,
        )
        return replace(self, to_world=moved, offset=offset)

    def view_projection(self, low: Real, high: Real) -> Real:
        """Return the matrix from world to OpenGL's clip space, for a scene between two corners.

        The matrix is for column vectors. Near and far planes lie close around the scene, for
        precise depths.
        """
        to_camera = np.linalg.inv(self.to_world)
        depths = box_corners(low, high) @ to_camera[2, :3] + to_camera[2, 3]
        outside = np.maximum(np.maximum(low - self.eye, self.eye - high), 0.0)
        far = max(float(depths.max()) * 1.001, 1e-6)
        near = max(0.5 * float(np.linalg.norm(outside)), float(depths.min()) * 0.999, 1e-5 * far)
        width, height = self.size
        scale = 1.0 / np.tan(np.radians(0.5 * self.fov))
        a, b = (far + near) / (far - near), -2.0 * far * near / (far - near)
        projection = np.array(
            [
                [-scale, 0.0, 2.0 * self.offset[0], 0.0],
                [0.0, scale * width / height, -2.0 * self.offset[1], 0.0],
                [0.0, 0.0, a, b],
                [0.0, 0.0, 1.0, 0.0],
            ]
        )
        return projection @ to_camera


def box_corners(low: Real, high: Real) -> Real:
    """Return the corners (8, 3) of a box from the lowest and highest one."""
    return np.array([[(low, high)[n >> i & 1][i] for i in range(3)] for n in range(8)])


def read_camera(sensor: Any) -> tuple[Camera, list[str]]:
    """Return the camera of a sensor, and names of its unsupported features.

    Raises a DiffractionError if the sensor is not a perspective camera.
    """
    import mitsuba as mi

    kind, parameters = sensor.class_name(), mi.traverse(sensor)
    if kind not in ("PerspectiveCamera", "ThinLensCamera"):
        raise DiffractionError(
            f"the sensor is a {kind}; the realtime renderer supports perspective cameras only: "
            "give the scene a <sensor type='perspective'>"
        )
    omissions = list[str]()
    width, height = (int(n) for n in sensor.film().size())
    if tuple(sensor.film().crop_size()) != (width, height):
        omissions.append("the film's crop")

    def number(name: str) -> float:
        """Return a parameter of the sensor, or 0 if it does not exist."""
        return float(np.array(parameters[name]).ravel()[0]) if name in parameters else 0.0

    camera = Camera(
        to_world=np.array(parameters["to_world"].matrix, np.float64).reshape(4, 4),
        fov=number("x_fov"),
        size=(width, height),
        offset=(number("principal_point_offset_x"), number("principal_point_offset_y")),
        lens=number("aperture_radius"),
        focus=number("focus_distance") or 1.0,
    )
    return camera, omissions
