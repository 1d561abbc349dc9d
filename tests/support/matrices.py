"""Boundary matrices under test, and pairs of directions for them."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.reference import model
from tests.support.directions import uniform_directions

MATRICES = (model.small_slope, model.kirchhoff)
#: Reversed light has its s axis reversed, its p axis as it was.
REVERSED = np.array([[1, -1], [-1, 1]])


def pairs(count: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Directions not quite at the horizon, where Kirchhoff's matrix has a pole."""
    directions = uniform_directions(2 * count, np.random.default_rng(2), lowest=0.05)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return directions[:count], directions[count:]
