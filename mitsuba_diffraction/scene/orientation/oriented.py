"""Laying a patch along given directions: a mesh whose tangents and orientations follow them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .trimesh import TriangleMesh, texture_tangents

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def oriented_mesh(
    positions: Floats,
    normals: Floats,
    faces: Ints,
    directions: Floats,
    uv: Floats | None = None,
) -> TriangleMesh:
    """A mesh on which the patch's x axis follows one direction per vertex.

    Mitsuba takes dp/du from each triangle's texture coordinates, and turns the patch from there by
    the mesh attribute `vertex_orientation`. So that their sum is one smooth field, every triangle
    has vertices of its own, whose orientation is the angle from *its* dp/du to the direction. Where
    the texture coordinates are made here, dp/du already is the mean direction in each triangle.

    Parameters
    ----------
    positions, normals : (n, 3).
    faces : (m, 3).
    directions : (n, 3), of any length, not along the normal; zero where there is none.
    uv : (n, 2), kept; None makes coordinates that unroll each triangle on its own, in the unit of
        the positions, which hold no picture together.

    Returns
    -------
    TriangleMesh
        With 3m vertices, in the order of `faces`.
    """
    corners, ends = positions[faces], normals[faces]
    wanted = _tangential(directions[faces], ends)
    texture, along = _unrolled(corners, ends, wanted)
    if uv is not None:
        given = uv[faces]
        sides = corners[:, 1:] - corners[:, :1]
        dp_du, _, area = texture_tangents(sides, given[:, 1:] - given[:, :1])
        good = (area != 0)[:, None]
        along = np.where(good, dp_du, along)
        # where they span nothing, they must span a little
        texture = np.where(good[:, None], given, given[:, :1] + 1e-4 * texture)
    first = _tangential(along[:, None], ends)
    second = np.cross(ends, first)
    turn = np.stack([(wanted * first).sum(axis=2), (wanted * second).sum(axis=2)], axis=2)
    return TriangleMesh(
        corners.reshape(-1, 3),
        ends.reshape(-1, 3),
        texture.reshape(-1, 2),
        np.arange(faces.size).reshape(-1, 3),
        turn.reshape(-1, 2),
    )


def _unrolled(corners: Floats, normals: Floats, wanted: Floats) -> tuple[Floats, Floats]:
    """Coordinates (m, 3, 2) in the plane of each triangle, and their u axis (m, 3)."""
    sides = corners[:, 1:] - corners[:, :1]
    flat = np.cross(sides[:, 0], sides[:, 1])
    # v on the same side of u for the surface's front, whichever way the triangle turns
    flat *= np.where((flat * normals.sum(axis=1)).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    flat = _unit(flat)
    mean = wanted.sum(axis=1)
    axis = _unit(mean - (mean * flat).sum(axis=1, keepdims=True) * flat)
    nowhere = ~axis.any(axis=1)
    axis[nowhere] = _unit(sides[nowhere, 0])
    across = np.cross(flat, axis)
    offsets = corners - corners[:, :1]
    coordinates = [(offsets * way[:, None]).sum(axis=2) for way in (axis, across)]
    return np.stack(coordinates, axis=2), axis


def _tangential(vectors: Floats, normals: Floats) -> Floats:
    """Unit vectors along the part of `vectors` at right angles to `normals`; zero stays zero."""
    return _unit(vectors - (vectors * normals).sum(axis=-1, keepdims=True) * normals)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)
