"""A closed tube in a trefoil knot, without texture coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.scene.orientation import grid_faces

from .limits import check_limits

Floats = NDArray[np.float64]


def knot(along: int = 160, around: int = 18) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Positions (n, 3), normals (n, 3) and faces (m, 3) of the knot; it stands on z = 0, in cm.

    Parameters
    ----------
    along, around : number of quadrangles; at the ends they meet in the same vertices.

    Raises
    ------
    DiffractionError
        If a number is out of its range.
    """
    parameters = {"along": along, "around": around}
    check_limits(parameters, {"along": (24, 10000), "around": (3, 1000)}, "knot")
    t = 2 * np.pi * np.arange(along) / along
    curve = np.stack(
        [np.sin(t) + 2 * np.sin(2 * t), np.sin(3 * t) * 1.2, np.cos(t) - 2 * np.cos(2 * t)], axis=1
    )
    tangent = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    first = np.cross(tangent, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(tangent, first)
    angle = 2 * np.pi * np.arange(around) / around
    normals = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    positions = (curve[:, None] + 0.62 * normals).reshape(-1, 3)
    positions[:, 2] -= positions[:, 2].min()
    grid = np.pad(np.arange(along * around).reshape(along, around), ((0, 1), (0, 1)), mode="wrap")
    return positions, normals.reshape(-1, 3), grid_faces(grid)[:, ::-1]
