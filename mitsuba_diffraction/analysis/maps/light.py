"""One direction to the light, and where a mirror would send it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics.geometry import check_angles


@dataclass(frozen=True)
class Light:
    """Direction to the light.

    Parameters
    ----------
    theta : degrees from the normal, 0 to below 90.
    phi : degrees from the patch's x axis towards its y axis, −360 to 360.

    Raises
    ------
    DiffractionError
        If an angle is out of range.
    """

    theta: float = 0.0
    phi: float = 0.0

    def __post_init__(self) -> None:
        check_angles(self.theta, self.phi)

    @property
    def direction(self) -> NDArray[np.float64]:
        """ωi, unit vector (3,) towards the light."""
        theta, phi = math.radians(self.theta), math.radians(self.phi)
        sin = math.sin(theta)
        return np.array([sin * math.cos(phi), sin * math.sin(phi), math.cos(theta)])

    @property
    def mirror(self) -> NDArray[np.float64]:
        """Unit vector (3,) in which a flat mirror reflects it."""
        return self.direction * [-1.0, -1.0, 1.0]

    def __str__(self) -> str:
        return f"θ = {self.theta:g}°, φ = {self.phi:g}°"
