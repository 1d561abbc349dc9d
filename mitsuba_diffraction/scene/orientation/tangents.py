"""Tangents of a mesh, judged by whether a measured patch can follow them.

A patch is laid along dp/du, which Mitsuba takes from the texture coordinates of each triangle, and
turned from there by the mesh attribute vertex_orientation, where the mesh has it. So a mesh needs
texture coordinates, they must span an area in every triangle, and the direction must not jump
between neighbours: where it does, the patch turns suddenly and the colours show a seam.

A field given at the corners of triangles turns within them, where the corners differ, and between
them, where two triangles differ at the edge that they share. Both are counted by length, not by
number or area: those of a line's triangles shrink as a mesh gets finer, its length does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...arrays import Real, Whole
from ..elements import ORIENTATION
from .trimesh import TriangleMesh, across, texture_tangents, turned, unit

Bools = NDArray[np.bool_]

#: Degrees: a field that turns by more within a triangle, or from one to the next, breaks there.
BREAK = 60.0
# Around a singular point a field has to turn by over 60° within a triangle or two. A line is longer
# than this many of its edges, or than this share of the mesh.
_EDGES, _SHARE = 4.0, 0.2

# Share of the surface on which texture coordinates may be mirrored: caps and small parts
MOST_MIRRORED = 0.05
MOST_TURNING = 0.05  # share of the surface on which the direction may turn too fast
LONG = 0.05  # share of the mesh's size: longer breaks, all together, are visible
TURN = 30.0  # degrees between neighbours from which on a seam shows

FLAT = 1e-3  # a smaller share of the median ratio of texture area to surface area counts as 0


def _length_of_breaks(places: Real, faces: Whole, crossed: Bools, jumps: Whole) -> float:
    """Total length of the lines along which a field breaks, in the unit of the positions.

    Within a triangle a line joins the middles of the edges along which the field turns; from one
    that has only one such edge, or three, it goes to the middle. Between triangles it is the edge.

    Parameters
    ----------
    places, faces : (n, 3) positions, each once; (m, 3) indices of them.
    crossed : (m, 3) whether the field turns by over 60° from corner n to corner n + 1.
    jumps : (e, 2) pairs of places: edges across which the field jumps by over 60 degrees.
    """
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)  # (m, 3, 2)
    edges = np.concatenate([ends[crossed], jumps])
    if not len(edges):
        return 0.0
    at = places[edges]
    middles = at.mean(axis=1)
    sizes = np.linalg.norm(at[:, 1] - at[:, 0], axis=1)
    # edges that follow each other share a corner
    n = len(places)
    graph = coo_array((np.ones(len(edges)), tuple(edges.T)), shape=(n, n))
    of_place = connected_components(graph, directed=False)[1]
    parts, part = np.unique(of_place[edges[:, 0]], return_inverse=True)
    low, high = np.full((len(parts), 3), np.inf), np.full((len(parts), 3), -np.inf)
    longest = np.zeros(len(parts))
    np.minimum.at(low, part, middles)
    np.maximum.at(high, part, middles)
    np.maximum.at(longest, part, sizes)
    extent = np.linalg.norm(high - low, axis=1)
    size = float(np.ptp(places[faces].reshape(-1, 3), axis=0).max())
    line = extent > np.minimum(_EDGES * longest, _SHARE * size)

    # in a triangle each crossed edge has the way from its middle to where the line's parts meet
    corners = places[faces]
    halves = (corners + np.roll(corners, -1, axis=1)) / 2
    paired = crossed.sum(axis=1, keepdims=True) == 2
    meeting = np.where(paired, (halves * crossed[..., None]).sum(axis=1) / 2, corners.mean(axis=1))
    within = np.linalg.norm(halves - meeting[:, None], axis=2)[crossed]
    length = np.concatenate([within, sizes[len(within) :]])
    return float(length[line[part]].sum())


@dataclass(frozen=True)
class TangentReport:
    """Findings of `check_tangents`; shares are of the surface area, 0 to 1."""

    triangles: int  # number of triangles with an area
    # has_uv, has_orientation: whether the mesh carries them
    has_uv: bool
    degenerate: float  # share whose texture coordinates span no area: no tangent there
    # share where u × v runs the other way round than on most of the surface; which way that is does
    # not matter, and Mitsuba flips v of OBJ files
    mirrored: float
    # share within which the direction turns by over 60 degrees, or which lies beside an edge across
    # which it turns by more than 30
    turning: float
    stretch: float  # median ratio of |dp/du| to |dp/dv| (1: no direction is stretched)
    # length of the lines along which the direction breaks, in the unit of the positions
    broken: float
    size: float  # longest side of the mesh along an axis
    has_orientation: bool = False

    @property
    def usable(self) -> bool:
        """True where a patch can follow nearly all of the surface."""
        return self.has_uv and self.degenerate < 0.01 and not self.turns_fast and not self.breaks

    @property
    def breaks(self) -> bool:
        """Whether the direction breaks along lines that are long enough to be seen."""
        return self.broken >= LONG * self.size and self.broken > 0

    @property
    def turns_fast(self) -> bool:
        """Whether the direction turns too fast for the triangles on much of the surface."""
        return self.turning >= MOST_TURNING

    def breaking(self) -> str:
        """Say how long the lines are along which the direction breaks."""
        return (
            f"breaks (turns by over {BREAK:g} degrees) along lines of {self.broken:.3g} in all, "
            f"{self.broken / self.size:.2g} times the mesh's size of {self.size:.3g}"
        )

    def problems(self) -> list[str]:
        """List reasons against this mesh, a line each, with the remedy."""
        if not self.has_uv:
            return [
                "no texture coordinates, so the patch has no direction: give the mesh one with "
                "the command 'tangents', or unwrap it so that u runs the way the patch's x "
                "axis shall"
            ]
        lines = []
        if self.degenerate >= 0.01:
            lines.append(
                f"{self.degenerate:.0%} of the surface has texture coordinates without area, hence "
                "no tangent: unwrap those parts"
            )
        remedy = "unwrap along the body in one piece"
        if self.has_orientation:
            remedy = "choose another guide of the command 'tangents', --along smooth or body"
        if self.breaks:
            lines.append(
                f"the patch's direction {self.breaking()}: colours will show seams; {remedy}"
            )
        if self.turns_fast:
            lines.append(
                f"the patch's direction turns by over {TURN:g} degrees between neighbours, or "
                f"{BREAK:g} within a triangle, on {self.turning:.0%} of the surface: colours will "
                f"show seams; use a finer mesh, or {remedy}"
            )
        if self.mirrored > MOST_MIRRORED and not self.has_orientation:
            lines.append(
                f"texture coordinates on {self.mirrored:.0%} of the surface are mirrored against "
                "the rest, where u may run the other way, and the patch with it: flip those parts"
            )
        return lines

    def summary(self) -> dict[str, Any]:
        """Plain numbers and strings, for printing."""
        direction = f"dp/du turned by {ORIENTATION}" if self.has_orientation else "dp/du"
        return {
            "triangles": self.triangles,
            "texture coordinates": self.has_uv,
            "direction of the patch": direction if self.has_uv else "none",
            "shares of the surface area, 0 to 1": {
                "without tangent": self.degenerate,
                "mirrored": self.mirrored,
                "turning tangent": self.turning,
            },
            "lines along which the direction breaks": {
                "length": self.broken,
                "length / mesh size": self.broken / self.size if self.size > 0 else 0.0,
            },
            "stretch, median |dp/du| / |dp/dv|": self.stretch,
            "usable": self.usable,
            "problems": self.problems(),
        }


def check_tangents(mesh: TriangleMesh) -> TangentReport:
    """Judge the direction of a patch on a mesh, as Mitsuba will compute it."""
    positions, faces, uv = mesh.positions, mesh.faces, mesh.uv
    sides = positions[faces[:, 1:]] - positions[faces[:, :1]]  # (m, 2, 3)
    front = across(positions[faces])
    area = np.linalg.norm(front, axis=1) / 2
    solid = area > 0
    faces, sides, front, area = faces[solid], sides[solid], front[solid], area[solid]
    total = area.sum()
    if uv is None or not len(faces):
        return TangentReport(len(faces), uv is not None, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    dp_du, dp_dv, signed = texture_tangents(sides, uv[faces[:, 1:]] - uv[faces[:, :1]])
    ratio = np.abs(signed) / area
    outward = mesh.normals[faces].sum(axis=1)
    mirrored = (np.cross(dp_du, dp_dv) * outward).sum(axis=1) < 0
    flat = ~(ratio > FLAT * np.median(ratio))
    good = ~flat
    tangent = np.where(good[:, None], unit(dp_du), 0.0)

    front /= 2 * area[:, None]
    front *= np.where((front * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    turn = mesh.orientation
    if turn is None:
        turn = np.tile([1.0, 0.0], (len(positions), 1))
    # vertices are split along seams of the texture, so neighbours are found by position
    places, welded = np.unique(positions, axis=0, return_inverse=True)
    corners = welded.reshape(-1)[faces]
    beside, jumps = _jumps(corners, front, tangent, turn[faces], good)
    turns = unit(turn[faces])
    crossed = (turns * np.roll(turns, -1, axis=1)).sum(axis=2) < np.cos(np.radians(BREAK))
    turning = beside | crossed.any(axis=1)
    lengths = np.linalg.norm(dp_du[good], axis=1), np.linalg.norm(dp_dv[good], axis=1)
    return TangentReport(
        triangles=len(faces),
        has_uv=True,
        degenerate=float(area[flat].sum() / total),
        mirrored=float(min(area[good & side].sum() for side in (mirrored, ~mirrored)) / total),
        turning=float(area[turning].sum() / total),
        stretch=float(np.median(lengths[0] / lengths[1])) if good.any() else 0.0,
        broken=_length_of_breaks(places, corners, crossed, jumps),
        size=float(np.ptp(positions[faces].reshape(-1, 3), axis=0).max()),
        has_orientation=mesh.orientation is not None,
    )


def carried(vectors: Real, before: Real, after: Real) -> Real:
    """Turn vectors (n, 3) by the smallest rotation of one unit normal to another (Rodrigues)."""
    axis = np.cross(before, after)
    cosine = (before * after).sum(axis=1, keepdims=True)
    along = (axis * vectors).sum(axis=1, keepdims=True) / np.maximum(1 + cosine, 1e-3)
    return vectors * cosine + np.cross(axis, vectors) + axis * along


def _jumps(
    welded: Whole, normals: Real, tangent: Real, turn: Real, good: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], Whole]:
    """Find edges across which the direction jumps, apart from the fold of the surface.

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
    this, other = owner[first], owner[first + 1]
    smooth = good[this] & good[other] & ((normals[this] * normals[other]).sum(axis=1) > 0.5)
    first, this, other = first[smooth], this[smooth], other[smooth]
    cosine = np.full(len(first), -1.0)
    for end in (0, 1):  # it must jump at both, or it is the turn within a triangle
        ways = [
            turned(tangent[face], normals[face], unit(ends[at, end]))
            for face, at in ((this, first), (other, first + 1))
        ]
        laid_over = carried(ways[0], normals[this], normals[other])  # a fold alone is no turn
        cosine = np.maximum(cosine, (laid_over * ways[1]).sum(axis=1))
    marked = np.zeros(len(welded), dtype=bool)
    jump = cosine < np.cos(np.radians(TURN))
    marked[this[jump]] = marked[other[jump]] = True
    return marked, edges[first[cosine < np.cos(np.radians(BREAK))]]
