"""Flat rings whose patch follows the radius, for compact discs and turned or spun surfaces."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.scene.orientation import TriangleMesh, grid_faces, oriented_mesh

from .limits import check_limits


def disc(inner: float, outer: float, sectors: int = 240) -> TriangleMesh:
    """A ring in the plane z = 0 that faces +z, the patch's x axis along the radius; lengths in cm.

    The direction is that of the radius at every place, not only on average over a sector.

    Parameters
    ----------
    inner, outer : radii; an inner one of 0 makes a disc without a hole.
    sectors : number of quadrangles around.

    Raises
    ------
    DiffractionError
        If the radii or the number are out of their ranges.
    """
    parameters = {"outer": outer, "inner": inner, "sectors": sectors}
    check_limits(parameters, {"outer": (1e-3, 1e4), "sectors": (12, 10000)}, "disc")
    check_limits(parameters, {"inner": (0.0, 0.999 * outer)}, "disc")
    angle = np.linspace(0, 2 * np.pi, sectors + 1)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    positions = np.concatenate([inner * around, outer * around])
    faces = grid_faces(np.arange(2 * (sectors + 1)).reshape(2, sectors + 1))
    if inner == 0:  # half of the triangles have their two inner corners in one point
        faces = faces[(faces < sectors + 1).sum(axis=1) == 1]
    normals = np.broadcast_to([0.0, 0.0, 1.0], positions.shape)
    return oriented_mesh(positions, normals, faces, np.tile(around, (2, 1)))
