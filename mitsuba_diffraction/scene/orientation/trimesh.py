"""Triangle meshes as arrays, and such on which a patch follows given directions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real, Whole
from ...errors import DiffractionError, counted

#: Angle (rad) between the sides of an edge from which on it is sharp, if the sides have vertices of
#: their own there, as a box has where its texture is cut.
CREASE = math.radians(60.0)
#: Vertices at one place with which others share their normals: a sphere's pole has some dozens.
_MOST_AT_ONE_PLACE = 64


class MeshArrays(NamedTuple):
    """Arrays of a triangle mesh as a file has them.

    Attributes
    ----------
    positions, normals : (n, 3); normals may be absent.
    uv : (n, 2) texture coordinates, or None.
    faces : (m, 3) indices of vertices.
    orientation : (n, 2) first channels of the attribute vertex_orientation, or None.
    materials : (m,) number of each triangle's material in a glTF file, or None.
    """

    positions: Real
    normals: Real | None
    uv: Real | None
    faces: Whole
    orientation: Real | None = None
    materials: Whole | None = None


@dataclass(frozen=True)
class TriangleMesh:
    """Vertices with normals and mostly texture coordinates, and the triangles between them.

    Attributes
    ----------
    positions, normals : (n, 3); normals are unit vectors.
    uv : (n, 2) texture coordinates, or None; dp/du is the first tangent, which a patch follows.
    faces : (m, 3) indices of vertices, counter-clockwise seen from outside.
    orientation : (n, 2) cosine and sine of the angle by which the patch is turned away from dp/du,
        or None.
    own_normals : whether its file holds the normals; otherwise `vertex_normals` has made them.
    materials : (m,) number of each triangle's material in a glTF file; None for other files.
    """

    positions: Real
    normals: Real
    uv: Real | None
    faces: Whole
    orientation: Real | None = None
    own_normals: bool = True
    materials: Whole | None = None

    def __post_init__(self) -> None:
        n = len(self.positions)
        widths = {"positions": 3, "normals": 3, "uv": 2, "orientation": 2}
        for name, width in widths.items():
            array = getattr(self, name)
            if array is not None and array.shape != (n, width):
                raise DiffractionError(
                    f"mesh: '{name}' has shape {array.shape}, where ({n}, {width}) is needed"
                )
        if self.faces.ndim != 2 or self.faces.shape[1] != 3:
            raise DiffractionError(f"mesh: 'faces' has shape {self.faces.shape}, not (m, 3)")
        if self.faces.size and not (0 <= self.faces.min() and self.faces.max() < n):
            raise DiffractionError(f"mesh: 'faces' names a vertex outside 0 to {n - 1}")

    def part(self, chosen: NDArray[np.bool_]) -> TriangleMesh:
        """Return the mesh of some triangles, (m,), with their vertices alone."""
        kept, faces = np.unique(self.faces[chosen], return_inverse=True)
        uv, turns = (None if a is None else a[kept] for a in (self.uv, self.orientation))
        return replace(
            self, positions=self.positions[kept], normals=self.normals[kept], uv=uv,
            faces=faces.reshape(-1, 3), orientation=turns,
            materials=None if self.materials is None else self.materials[chosen],
        )  # fmt: skip


def cell_corners(grid: Whole) -> tuple[Whole, ...]:
    """The four corners of every cell of a grid of vertex numbers, in the sense of rotation."""
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return tuple(corner.ravel() for corner in corners)


def grid_faces(grid: Whole) -> Whole:
    """Two triangles for every cell of a grid of vertex numbers."""
    a, b, c, d = cell_corners(grid)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def across(corners: Real) -> Real:
    """Normals (m, 3) of triangles (m, 3, 3), twice as long as their areas are large."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def vertex_normals(positions: Real, faces: Whole, uv: Real | None = None) -> Real:
    """Return smooth unit normals (n, 3): the mean over the triangles at a vertex.

    Triangles count by their angles there (Thürmer and Wüthrich 1998, *Computing vertex normals from
    polygonal facets*), so that it does not matter how a polygon is cut. Vertices at one place with
    one texture coordinate are one vertex. Others at one place, as along seams of the texture, share
    their normals where these differ by less than `CREASE`.
    """
    keys = positions if uv is None else np.concatenate([positions, uv], axis=1)
    distinct, vertex = np.unique(keys, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1)
    corners, own = positions[faces], np.zeros((len(distinct), 3))
    with np.errstate(invalid="ignore", over="ignore"):  # readers refuse what is not finite
        front = unit(across(corners))
        for n in range(3):
            one, other = (unit(corners[:, (n + k) % 3] - corners[:, n]) for k in (1, 2))
            angle = np.arccos(np.clip((one * other).sum(axis=1, keepdims=True), -1.0, 1.0))
            np.add.at(own, vertex[faces[:, n]], angle * front)
    total = _shared(own, np.unique(distinct[:, :3], axis=0, return_inverse=True)[1].reshape(-1))
    return np.where(total.any(axis=1, keepdims=True), unit(total), [0.0, 0.0, 1.0])[vertex]


def _shared(normals: Real, places: Whole) -> Real:
    """Return the sum of the normals at each vertex's place that are within `CREASE` of its own."""
    order = np.argsort(places, kind="stable")
    counts = np.bincount(places)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    ranks = np.empty_like(order)
    ranks[order] = np.arange(len(order)) - first[places[order]]
    total = np.where(ranks[:, None] < _MOST_AT_ONE_PLACE, 0.0, normals)
    directions = unit(normals)
    for rank in range(min(int(counts.max(initial=0)), _MOST_AT_ONE_PLACE)):
        (here,) = np.nonzero(counts[places] > rank)
        there = order[first[places[here]] + rank]
        near = (directions[here] * directions[there]).sum(axis=1) > math.cos(CREASE)
        total[here] += np.where(near[:, None], normals[there], 0.0)
    return total


def texture_tangents(sides: Real, uv_sides: Real) -> tuple[Real, Real, Real]:
    """Return dp/du and dp/dv (m, 3) of triangles, and their signed areas (m,) in (u, v).

    sides, uv_sides : (m, 2, 3), (m, 2, 2) two sides of each, in space and in (u, v).

    Solves sides = uv_sides · (dp/du, dp/dv); where (u, v) span no area the result is zero.
    """
    (du0, dv0), (du1, dv1) = uv_sides[:, 0].T, uv_sides[:, 1].T
    determinant = du0 * dv1 - dv0 * du1
    safe = np.where(determinant == 0, np.inf, determinant)[:, None]
    dp_du = (dv1[:, None] * sides[:, 0] - dv0[:, None] * sides[:, 1]) / safe
    dp_dv = (du0[:, None] * sides[:, 1] - du1[:, None] * sides[:, 0]) / safe
    return dp_du, dp_dv, determinant / 2


def oriented_mesh(
    positions: Real, normals: Real, faces: Whole, directions: Real, uv: Real | None = None
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
    directions : (n, 3), of any length, not along the normal; zero without a direction.
    uv : (n, 2), kept; None makes coordinates that unroll each triangle on its own, in the unit of
        the positions, which hold no picture together.

    Returns
    -------
    TriangleMesh
        With 3m vertices, in the order of `faces`.
    """
    corners, ends = positions[faces], normals[faces]
    wanted = tangential(directions[faces], ends)
    texture, along = _unrolled(corners, ends, wanted)
    if uv is not None:
        coordinates = uv[faces]
        sides = corners[:, 1:] - corners[:, :1]
        dp_du, _, area = texture_tangents(sides, coordinates[:, 1:] - coordinates[:, :1])
        good = (area != 0)[:, None]
        along = np.where(good, dp_du, along)
        # where they span nothing, they must span a little
        texture = np.where(good[:, None], coordinates, coordinates[:, :1] + 1e-4 * texture)
    first = tangential(along[:, None], ends)
    second = np.cross(ends, first)
    turn = np.stack([(wanted * first).sum(axis=2), (wanted * second).sum(axis=2)], axis=2)
    return TriangleMesh(
        corners.reshape(-1, 3),
        ends.reshape(-1, 3),
        texture.reshape(-1, 2),
        np.arange(faces.size).reshape(-1, 3),
        turn.reshape(-1, 2),
    )


def _unrolled(corners: Real, normals: Real, wanted: Real) -> tuple[Real, Real]:
    """Coordinates (m, 3, 2) in the plane of each triangle, and their u axis (m, 3)."""
    sides = corners[:, 1:] - corners[:, :1]
    flat = np.cross(sides[:, 0], sides[:, 1])
    # v on the same side of u for the surface's front, whichever way the triangle turns
    flat *= np.where((flat * normals.sum(axis=1)).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    flat = unit(flat)
    mean = wanted.sum(axis=1)
    axis = unit(mean - (mean * flat).sum(axis=1, keepdims=True) * flat)
    nowhere = ~axis.any(axis=1)
    axis[nowhere] = unit(sides[nowhere, 0])
    across = np.cross(flat, axis)
    offsets = corners - corners[:, :1]
    coordinates = [(offsets * way[:, None]).sum(axis=2) for way in (axis, across)]
    return np.stack(coordinates, axis=2), axis


def tangential(vectors: Real, normals: Real) -> Real:
    """Unit vectors along the part of `vectors` at right angles to `normals`; zero stays zero."""
    return unit(vectors - (vectors * normals).sum(axis=-1, keepdims=True) * normals)


def turned(directions: Real, normals: Real, turn: Real) -> Real:
    """Turn tangents (n, 3) around unit normals, counter-clockwise seen from outside.

    turn : (n, 2) or (2,) cosine and sine of the angle.
    """
    cosine, sine = np.split(turn, 2, axis=-1)
    return cosine * directions + sine * np.cross(normals, directions)


def check_finite(vertices: Real, shown: str) -> None:
    """Raise a DiffractionError if a row (n, …) of vertices is not finite."""
    lost = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(lost):
        count = counted(len(lost), "such vertex", "such vertices")
        raise DiffractionError(
            f"{shown}: vertex {lost[0]} is not finite ({count}); repair the mesh"
        )


def unit(vectors: Real) -> Real:
    """Normalise vectors (…, 3); zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)
