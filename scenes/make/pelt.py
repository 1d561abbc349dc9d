"""The skin as one closed mesh of overlapping scales.

A wall of undercut triangles joins a scale's rear edges to the front edges of those below it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.scene.orientation import TriangleMesh, cell_corners, grid_faces

from .scales import Scales, smoothstep
from .skin import Placement, Skin

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BELLY_COLUMNS = (1.0, 0.6, 0.25, 0.0)  # places across half a scute, from its edge to the middle


@dataclass(frozen=True)
class Pelt:
    """The scaled part of the skin as a mesh, and the rings of vertices at its two ends.

    The rings run once around, from v = 0 to v = 1.
    """

    mesh: TriangleMesh
    front: Ints
    rear: Ints


def pelt(skin: Skin, scales: Scales, first: int, last: int) -> Pelt:
    """Cover the skin with scales from u = first·pitch to u = last·pitch.

    The ends are straight: there the scales of every other row are cut in half.
    """
    lattice = _Lattice(scales, first, last)
    for row in range(scales.rows):
        for column in range(first, last + 1 - row % 2):
            lattice.add_tile(row, column)
    for column in range(first, last):
        lattice.add_scute(column, side=0)
        lattice.add_scute(column, side=1)
    faces = np.concatenate([*lattice.faces, *lattice.walls()])
    mesh = TriangleMesh(*lattice.vertices(skin), faces, lattice.orientation())
    return Pelt(mesh, lattice.ring("front"), lattice.ring("rear"))


Point = tuple[int, int]  # of the lattice: v in row pitches from the belly, u in half pitches


class _Lattice:
    """Collects scales, and the edges at which one scale lies above another."""

    def __init__(self, scales: Scales, first: int, last: int) -> None:
        self.scales, self.first, self.last = scales, first, last
        self.count = 0
        self.faces: list[Ints] = []
        self._tiles: list[Floats] = []  # rows: start, level, p, q, index
        self._scutes: list[Floats] = []  # rows: start, side, along, across, index
        self._above: dict[tuple[Point, Point], tuple[Ints, bool]] = {}
        self._below: dict[tuple[Point, Point], Ints] = {}
        self._rings: dict[str, list[tuple[float, Ints]]] = {"front": [], "rear": []}

    def add_tile(self, row: int, column: int) -> None:
        """Add the scale of a row whose middle lies at u = column·pitch (odd rows: + pitch/2)."""
        n, level, start = self.scales.detail, row + 1, 2 * column + row % 2 - 1
        front_half = row % 2 == 0 and column == self.last
        rear_half = row % 2 == 0 and column == self.first
        p, q = (g.ravel() for g in np.meshgrid(*2 * [np.arange(n + 1)], indexing="ij"))
        keep = (p + q <= n) if front_half else (p + q >= n) if rear_half else p >= 0
        index = self._number(keep)
        columns = [np.full(keep.sum(), start), np.full(keep.sum(), level), p[keep] / n, q[keep] / n]
        self._tiles.append(np.stack([*columns, index[keep]]))

        grid = index.reshape(n + 1, n + 1)
        a, b, c, d = cell_corners(grid)
        # cells are split along the keel, but along the cut where a scale is halved
        triangles = [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
        if front_half:
            triangles.append(np.stack([a, b, d], 1)[c < 0])
        if rear_half:
            triangles.append(np.stack([b, c, d], 1)[a < 0])
        every = np.concatenate(triangles)
        self.faces.append(every[(every >= 0).all(axis=1)])

        front, rear = (level, start), (level, start + 2)
        left, right = (level - 1, start + 1), (level + 1, start + 1)
        if not rear_half:
            self._below[front, left] = grid[:, 0]
            self._below[front, right] = grid[0, :]
        if not front_half:
            self._above[left, rear] = grid[n, :], True
            self._above[right, rear] = grid[:, n], False
        if front_half or rear_half:
            steps = np.arange(n + 1)
            self._rings["rear" if front_half else "front"].append((level, grid[n - steps, steps]))

    def add_scute(self, column: int, side: int) -> None:
        """Add half of the belly scale that begins at u = column·pitch."""
        n, start, width = self.scales.detail, 2 * column, len(BELLY_COLUMNS)
        along, across = np.meshgrid(np.arange(2 * n + 1) / (2 * n), BELLY_COLUMNS, indexing="ij")
        index = self._number(np.ones(along.size, dtype=bool))
        columns = [np.full(along.size, start), np.full(along.size, side)]
        self._scutes.append(np.stack([*columns, along.ravel(), across.ravel(), index]))

        grid = index.reshape(2 * n + 1, width)
        triangles = grid_faces(grid)
        # from the lowest scales to the seam v falls on one side and rises on the other
        self.faces.append(triangles if side else triangles[:, ::-1])

        top = self.scales.rows + 1
        outer, inner, seam = (top, top - 1, top + 1) if side else (0, 1, -1)
        corner, notch, end = (outer, start), (inner, start + 1), (outer, start + 2)
        self._below[corner, notch] = grid[: n + 1, 0]
        self._above[notch, end] = grid[n:, 0], bool(side)
        self._below[corner, (seam, start)] = grid[0]
        self._above[end, (seam, start + 2)] = grid[-1], bool(side)
        for name, at, line in (("front", self.first, 0), ("rear", self.last - 1, -1)):
            if column == at:
                self._rings[name].append((seam, grid[line] if side else grid[line][::-1]))

    def walls(self) -> list[Ints]:
        """Triangles from the rear edges of scales down to the scales that they cover."""
        triangles = []
        for edge, (upper, forward) in self._above.items():
            if edge not in self._below:
                continue  # at the ends of the pelt
            lower = self._below[edge]
            if not forward:
                upper, lower = upper[::-1], lower[::-1]
            triangles.append(np.stack([upper[1:], upper[:-1], lower[:-1]], 1))
            triangles.append(np.stack([upper[1:], lower[:-1], lower[1:]], 1))
            # where two scutes meet a scale of the back, a small gap opens between the three
            level, start = edge[1]
            if level in (0, self.scales.rows + 1):
                inner = edge[0][0]
                behind = self._below.get(((level, start), (inner, start + 1)))
                if behind is not None:
                    gap = np.array([[self._above[edge][0][-1], self._below[edge][-1], behind[0]]])
                    triangles.append(gap if forward else gap[:, ::-1])
        return triangles

    def ring(self, name: str) -> Ints:
        """Vertices at one end of the pelt, from v = 0 to v = 1."""
        return np.concatenate([chain for _, chain in sorted(self._rings[name], key=lambda r: r[0])])

    def vertices(self, skin: Skin) -> tuple[Floats, Floats, Floats]:
        """Positions, normals and texture coordinates of all vertices."""
        positions, normals = np.empty((self.count, 3)), np.empty((self.count, 3))
        uv = np.empty((self.count, 2))
        scales, ends = self.scales, np.array([self.first, self.last]) * self.scales.pitch
        shape = (2, scales.rows + 2, 2 * self.last + 2)
        largest = np.radians(scales.irregularity)
        tilts = np.random.default_rng(scales.seed).uniform(-largest, largest, shape)

        for rows, surface in ((self._tiles, scales.tile), (self._scutes, scales.scute)):
            start, which, first, second, index = np.concatenate(rows, axis=1)
            i = index.astype(np.int64)
            askew = tilts[:, which.astype(np.int64), start.astype(np.int64)]
            place = _placement(surface, start, which, askew, ends, scales.pitch)
            positions[i], normals[i] = skin.patch(place, first, second)
            uv[i] = np.stack(place(first, second)[:2], axis=1)
        # half of the scutes are mapped with v falling
        outward = skin.normals(uv[:, 0], uv[:, 1])
        normals *= np.sign((normals * outward).sum(axis=1))[:, None]
        return positions, normals, uv

    def orientation(self) -> Floats:
        """Cosine and sine of the angle between the patch and dp/du at all vertices."""
        angle = np.full(self.count, np.radians(self.scales.turn))
        _, _, p, q, index = np.concatenate(self._tiles, axis=1)
        angle[index.astype(np.int64)] += np.radians(self.scales.fan) * (q - p)
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def _number(self, keep: NDArray[np.bool_]) -> Ints:
        index = np.full(len(keep), -1)
        index[keep] = self.count + np.arange(keep.sum())
        self.count += int(keep.sum())
        return index


def _placement(
    surface: Callable[..., tuple[Floats, ...]],
    start: Floats,
    which: Floats,
    askew: Floats,
    ends: Floats,
    pitch: float,
) -> Placement:
    """The scales as one surface over (p, q), their relief fading towards the ends of the pelt."""

    def place(a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
        u, v, height = surface(start, which, a, b, askew)
        rising = smoothstep(np.minimum(u - ends[0], ends[1] - u) / (3 * pitch))
        return u, v, height * (0.4 + 0.6 * rising)

    return place
