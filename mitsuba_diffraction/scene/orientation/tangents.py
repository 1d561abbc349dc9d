"""Does a mesh have the tangents that a measured patch needs?

A patch is laid along dp/du, which Mitsuba takes from the texture coordinates of each triangle, and
turned from there by the mesh attribute vertex_orientation, where the mesh has it. So a mesh needs
texture coordinates, they must span an area in every triangle, and the direction must not jump
between neighbours: where it does, the patch turns suddenly and the colours show a seam.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .breaks import BREAK, Corners, length_of_breaks
from .report import TURN, TangentReport
from .trimesh import texture_tangents

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FLAT = 1e-3  # of the typical ratio of texture area to surface area: as good as none


def check_tangents(
    positions: Floats,
    normals: Floats | None,
    uv: Floats | None,
    faces: Ints,
    orientation: Floats | None = None,
) -> TangentReport:
    """Judge the direction of a patch on a mesh, as Mitsuba will compute it.

    Parameters
    ----------
    positions, normals, uv, faces : as from `load_mesh`.
    orientation : (n, 2) cosine and sine of the angle from dp/du, or None where it is not turned.
    """
    sides = positions[faces[:, 1:]] - positions[faces[:, :1]]  # (m, 2, 3)
    across = np.cross(sides[:, 0], sides[:, 1])
    area = np.linalg.norm(across, axis=1) / 2
    real = area > 0
    faces, sides, across, area = faces[real], sides[real], across[real], area[real]
    total = area.sum()
    if uv is None or not len(faces):
        return TangentReport(
            len(faces), uv is not None, normals is not None, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        )

    dp_du, dp_dv, signed = texture_tangents(sides, uv[faces[:, 1:]] - uv[faces[:, :1]])
    ratio = np.abs(signed) / area
    outward = across if normals is None else normals[faces].sum(axis=1)
    mirrored = (np.cross(dp_du, dp_dv) * outward).sum(axis=1) < 0
    flat = ~(ratio > FLAT * np.median(ratio))
    good = ~flat
    tangent = np.zeros_like(dp_du)
    tangent[good] = dp_du[good] / np.linalg.norm(dp_du[good], axis=1, keepdims=True)

    front = across / (2 * area[:, None])
    front *= np.where((front * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    turn = np.tile([1.0, 0.0], (len(positions), 1)) if orientation is None else orientation
    # vertices are split along seams of the texture, so neighbours are found by position
    places, welded = np.unique(positions, axis=0, return_inverse=True)
    beside, jumps = _jumps(welded.reshape(-1)[faces], front, tangent, turn[faces], good)
    corners = Corners(places, welded.reshape(-1)[faces], turn[faces], jumps)
    turning = beside | corners.turning().any(axis=1)
    lengths = np.linalg.norm(dp_du[good], axis=1), np.linalg.norm(dp_dv[good], axis=1)
    return TangentReport(
        triangles=len(faces),
        has_uv=True,
        has_normals=normals is not None,
        degenerate=float(area[flat].sum() / total),
        mirrored=float(area[good & mirrored].sum() / total),
        turning=float(area[turning].sum() / total),
        stretch=float(np.median(lengths[0] / lengths[1])) if good.any() else 0.0,
        broken=length_of_breaks(corners),
        size=float(np.ptp(positions[faces].reshape(-1, 3), axis=0).max()),
        has_orientation=orientation is not None,
    )


def carried(vectors: Floats, before: Floats, after: Floats) -> Floats:
    """Vectors (n, 3) turned by the smallest rotation of one unit normal to another (Rodrigues)."""
    axis = np.cross(before, after)
    cosine = (before * after).sum(axis=1, keepdims=True)
    along = (axis * vectors).sum(axis=1, keepdims=True) / np.maximum(1 + cosine, 1e-3)
    return vectors * cosine + np.cross(axis, vectors) + axis * along


def _jumps(
    welded: Ints, normals: Floats, tangent: Floats, turn: Floats, good: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], Ints]:
    """Across which edges the direction jumps, the fold of the surface apart.

    Parameters
    ----------
    welded : (m, 3) places of the corners.
    normals, tangent : (m, 3) unit vectors of the triangles.
    turn : (m, 3, 2) cosine and sine of the angle from the tangent at each corner.
    good : (m,) triangles that have a tangent.

    Returns
    -------
    (m,) triangles beside an edge across which it turns by over 30°; (e, 2) edges of over 60°.
    """
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    # at both ends of an edge, the lower place first
    ends = np.concatenate([turn[:, [0, 1]], turn[:, [1, 2]], turn[:, [2, 0]]])
    ends = np.where((edges[:, 0] > edges[:, 1])[:, None, None], ends[:, ::-1], ends)
    owner = np.tile(np.arange(len(welded)), 3)
    edges = np.sort(edges, axis=1)
    order = np.lexsort(edges.T)
    edges, owner, ends = edges[order], owner[order], ends[order]
    first = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))

    # sharp folds (scale edges, corners of a box) are edges of the surface, not of the texture
    one, two = owner[first], owner[first + 1]
    smooth = good[one] & good[two] & ((normals[one] * normals[two]).sum(axis=1) > 0.5)
    first, one, two = first[smooth], one[smooth], two[smooth]
    cosine = np.full(len(first), -1.0)
    for end in (0, 1):  # it must jump at both, or it is the turn within a triangle
        ways = [
            _laid(tangent[face], normals[face], ends[at, end])
            for face, at in ((one, first), (two, first + 1))
        ]
        laid_over = carried(ways[0], normals[one], normals[two])  # a fold alone is no turn
        cosine = np.maximum(cosine, (laid_over * ways[1]).sum(axis=1))
    marked = np.zeros(len(welded), dtype=bool)
    jump = cosine < np.cos(np.radians(TURN))
    marked[one[jump]] = marked[two[jump]] = True
    return marked, edges[first[cosine < np.cos(np.radians(BREAK))]]


def _laid(tangent: Floats, normal: Floats, turn: Floats) -> Floats:
    """Unit tangents (n, 3) turned by (cosine, sine) (n, 2) counter-clockwise around normals."""
    unit = turn / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12)
    return unit[:, :1] * tangent + unit[:, 1:] * np.cross(normal, tangent)
