"""Moving a camera and a light by hand (NumPy only)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .camera import Camera
from .lights import Light

Array = NDArray[np.float64]

_UPRIGHT = 0.05  # least cosine between the camera's and the scene's up


@dataclass(frozen=True)
class Orbit:
    """A camera around a point.

    Attributes
    ----------
    to_world : of the camera, which looks along z, with x to the left and y up.
    target : (3,) what it turns around, straight ahead.
    up : (3,) of the scene.
    """

    to_world: Array
    target: Array
    up: Array

    @classmethod
    def of(cls, camera: Camera, middle: Array) -> Orbit:
        """Start at a camera; what it turns around is as far away as `middle`."""
        forward, eye = camera.to_world[:3, 2], camera.eye
        distance = max(float((middle - eye) @ forward), 1e-3 * float(np.linalg.norm(middle - eye)))
        above = camera.to_world[:3, 1]
        axis = int(np.argmax(np.abs(above)))
        up = np.zeros(3)
        up[axis] = np.sign(above[axis])
        return cls(camera.to_world, eye + distance * forward, up)

    @property
    def distance(self) -> float:
        """From the camera to the point."""
        return float(np.linalg.norm(self.target - self.to_world[:3, 3]))

    def turned(self, right: float, up: float) -> Orbit:
        """Around the point by these angles (rad); never over the top."""
        side = -self.to_world[:3, 0]
        rotation = rotation_about(self.up, -right) @ rotation_about(side, -up)
        moved = self._rotated(rotation)
        if moved[:3, 1] @ self.up < _UPRIGHT:
            moved = self._rotated(rotation_about(self.up, -right))
        return dataclasses.replace(self, to_world=moved)

    def panned(self, right: float, up: float) -> Orbit:
        """Sideways, in multiples of the distance."""
        step = self.distance * (up * self.to_world[:3, 1] - right * self.to_world[:3, 0])
        moved = self.to_world.copy()
        moved[:3, 3] += step
        return dataclasses.replace(self, to_world=moved, target=self.target + step)

    def zoomed(self, factor: float) -> Orbit:
        """To `factor` times the distance."""
        moved = self.to_world.copy()
        moved[:3, 3] = self.target + factor * (moved[:3, 3] - self.target)
        return dataclasses.replace(self, to_world=moved)

    def _rotated(self, rotation: Array) -> Array:
        moved = self.to_world.copy()
        moved[:3, :3] = rotation @ moved[:3, :3]
        moved[:3, 3] = self.target + rotation @ (moved[:3, 3] - self.target)
        return moved


def dragged(light: Light, orbit: Orbit, right: float, up: float) -> Light:
    """A light turned around the point that the camera looks at, as seen from it (rad)."""
    rotation = rotation_about(orbit.to_world[:3, 1], right)
    rotation = rotation_about(-orbit.to_world[:3, 0], -up) @ rotation
    centre = orbit.target * light.place[3]
    place = np.append(rotation @ (light.place[:3] - centre) + centre, light.place[3])
    return dataclasses.replace(light, place=place)


def rotation_about(axis: Array, angle: float) -> Array:
    """Rotation matrix (3, 3) about a unit vector, counter-clockwise."""
    return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix())
