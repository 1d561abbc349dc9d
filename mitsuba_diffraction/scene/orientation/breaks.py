"""Where a field of directions breaks: lines on a mesh, with their length.

A field given at the corners of triangles turns within them, where the corners differ, and between
them, where two triangles differ at the edge that they share. Both are counted by length, not by
number or area: those of a line's triangles shrink as a mesh gets finer, its length does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: Degrees: a field that turns by more within a triangle, or from one to the next, breaks there.
BREAK = 60.0
# Around a singular point a field turns by over 60° within a triangle or two, and has to. What is
# longer than this many of its own edges, or than this share of the mesh, is a line.
_EDGES, _SHARE = 4.0, 0.2


@dataclass(frozen=True)
class Corners:
    """A field at the corners of triangles, and where neighbours share an edge."""

    places: Floats  # (n, 3) positions, each once
    faces: Ints  # (m, 3) indices of places
    orientation: Floats  # (m, 3, 2) cosine and sine of the angle from each triangle's tangent
    jumps: Ints  # (e, 2) pairs of places: edges across which the field jumps by over 60 degrees

    def turning(self) -> Bools:
        """(m, 3) whether the field turns by over 60° on the way from corner n to corner n + 1."""
        unit = self.orientation / np.maximum(
            np.linalg.norm(self.orientation, axis=2, keepdims=True), 1e-12
        )
        cosine = (unit * np.roll(unit, -1, axis=1)).sum(axis=2)
        return np.asarray(cosine < np.cos(np.radians(BREAK)))


def length_of_breaks(corners: Corners) -> float:
    """Total length of the lines along which a field breaks, in the unit of the positions.

    Within a triangle a line joins the middles of the edges along which the field turns; from one
    that has only one such edge, or three, it goes to the middle. Between triangles it is the edge.
    """
    crossed = corners.turning()
    ends = np.stack([corners.faces, np.roll(corners.faces, -1, axis=1)], axis=2)  # (m, 3, 2)
    edges = np.concatenate([ends[crossed], corners.jumps])
    if not len(edges):
        return 0.0
    at = corners.places[edges]
    middles = at.mean(axis=1)
    sizes = np.linalg.norm(at[:, 1] - at[:, 0], axis=1)
    # edges that follow each other share a corner
    n = len(corners.places)
    graph = coo_array((np.ones(len(edges)), tuple(edges.T)), shape=(n, n))
    count, of_place = connected_components(graph, directed=False)
    part = of_place[edges[:, 0]]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    longest = np.zeros(count)
    np.minimum.at(low, part, middles)
    np.maximum.at(high, part, middles)
    np.maximum.at(longest, part, sizes)
    used = longest > 0
    extent = np.zeros(count)
    extent[used] = np.linalg.norm(high[used] - low[used], axis=1)
    size = float(np.ptp(corners.places[corners.faces].reshape(-1, 3), axis=0).max())
    line = extent > np.minimum(_EDGES * longest, _SHARE * size)

    length = np.zeros(len(edges))
    within = int(crossed.sum())
    length[within:] = sizes[within:]
    length[:within] = _shares(corners, crossed, middles[:within])
    return float(length[line[part]].sum())


def _shares(corners: Corners, crossed: Bools, middles: Floats) -> Floats:
    """Length of the line in a triangle that falls to each of its crossed edges."""
    owner = np.nonzero(crossed)[0]
    meeting = corners.places[corners.faces].mean(axis=1)
    both = crossed.sum(axis=1) == 2
    total = np.zeros_like(meeting)
    np.add.at(total, owner, middles)
    # from both middles half-way to each other
    meeting[both] = total[both] / 2
    return np.asarray(np.linalg.norm(middles - meeting[owner], axis=1))
