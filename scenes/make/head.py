"""The ends of a snake: a head with shields, mouth, brows and eyes, and the tip of the tail.

Places on the head are given as (x, d): x is the arc length from the snout in head lengths, d the
distance from the middle of the back in circumferences, 0.25 at the sides and 0.5 under the chin.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.scene.orientation import TriangleMesh, grid_faces

from .anatomy import Anatomy
from .skin import Skin

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Polylines = tuple[tuple[tuple[float, float], ...], ...]

EYE = (0.37, 0.185)
EYE_RADIUS = 0.078  # head lengths
NOSTRIL = (0.075, 0.19)
MOUTH_END = 0.8

# Sutures between the shields of a colubrid's head, as polylines of (x, d): internasals and
# prefrontals, the frontal between the brows, the parietals behind, and the labials at the mouth.
LABIALS = (0.10, 0.19, 0.28, 0.38, 0.49, 0.61, 0.73)
SUTURES: Polylines = (
    ((0.03, 0.0), (0.27, 0.0)),
    ((0.14, 0.0), (0.15, 0.16)),
    ((0.27, 0.0), (0.27, 0.055), (0.25, 0.14)),
    ((0.27, 0.055), (0.47, 0.036), (0.55, 0.0), (0.88, 0.0)),
    ((0.47, 0.036), (0.51, 0.12), (0.82, 0.12), (0.88, 0.0)),
    ((0.05, 0.232), (0.80, 0.225)),
    ((0.06, 0.345), (0.80, 0.345)),
    *(((x, 0.232), (x - 0.01, 0.283)) for x in LABIALS),
    *(((x, 0.295), (x + 0.01, 0.345)) for x in LABIALS),
)


def mouth(x: Floats) -> Floats:
    """Where the line of the mouth runs: d over x, up to MOUTH_END."""
    return 0.290 - 0.010 * np.sin(np.pi * x / 0.55) - 0.05 * np.clip(x - 0.68, 0, None)


def line_distance(lines: Polylines, anatomy: Anatomy, x: Floats, d: Floats) -> Floats:
    """Distance to the nearest of some polylines in head lengths, measured on the skin."""
    around = _around(anatomy, x)
    nearest = np.full(np.shape(x), np.inf)
    for line in lines:
        for (x0, d0), (x1, d1) in pairwise(line):
            ex, ey = x1 - x0, (d1 - d0) * around
            px, py = x - x0, (d - d0) * around
            share = (px * ex + py * ey) / np.maximum(ex**2 + ey**2, 1e-12)
            t = np.clip(share, 0, 1)
            nearest = np.minimum(nearest, np.hypot(px - t * ex, py - t * ey))
    return nearest


def mouth_distance(anatomy: Anatomy, x: Floats, d: Floats) -> Floats:
    """Distance to the line of the mouth in head lengths."""
    distance = np.abs(d - mouth(x)) * _around(anatomy, x)
    return np.where(x < MOUTH_END, distance, np.hypot(distance, x - MOUTH_END))


def _around(anatomy: Anatomy, x: Floats) -> Floats:
    """Length around the head, in head lengths."""
    return 2 * np.pi * anatomy.mean_radius(x * anatomy.head_length) / anatomy.head_length


def _relief(anatomy: Anatomy, x: Floats, d: Floats) -> Floats:
    """Height over the smooth head, in head lengths."""
    around = _around(anatomy, x)

    def bump(place: tuple[float, float], long: float, wide: float) -> Floats:
        return np.exp(-(((x - place[0]) / long) ** 2) - ((d - place[1]) * around / wide) ** 2)

    brow = 0.030 * bump((0.36, 0.125), 0.13, 0.07)
    cheek = 0.025 * bump((0.68, 0.20), 0.16, 0.14)
    socket = -0.030 * bump(EYE, 0.085, 0.085)
    nostril = -0.020 * bump(NOSTRIL, 0.020, 0.016)
    lips = -0.014 * np.exp(-((mouth_distance(anatomy, x, d) / 0.019) ** 2))
    # shields are a little convex between their sutures
    shields = 0.006 * (np.minimum(line_distance(SUTURES, anatomy, x, d), 0.05) / 0.05) - 0.006
    fade = np.clip((0.97 - x) / 0.1, 0, 1) * np.clip(x / 0.03, 0, 1)
    return (brow + cheek + socket + nostril + lips + shields) * fade


def head(skin: Skin, u_end: float, rear_height: float, rows: int, columns: int) -> TriangleMesh:
    """A closed cap from the snout to u_end; its last `columns` + 1 vertices are the open ring.

    Parameters
    ----------
    rear_height : height over the skin at the ring in circumferences, where scales begin.
    rows, columns : cells along u and around.
    """
    size = skin.anatomy.head_length

    def height(u: Floats, v: Floats) -> Floats:
        x = skin.arc(u) / size
        cm = size * _relief(skin.anatomy, x, np.abs(v - 0.5))
        scale = np.maximum(skin.circumference(u), 0.3 * size)  # no spike where the snout closes
        return cm / scale + rear_height * np.clip(u / u_end, 0, 1) ** 6

    return _cap(skin, height, np.linspace(0, u_end, rows + 1), columns)


def tail(skin: Skin, u_start: float, front_height: float, rows: int, columns: int) -> TriangleMesh:
    """A closed cap from u_start to the tail tip; its first `columns` + 1 vertices are the ring."""

    def height(u: Floats, v: Floats) -> Floats:
        share = (u - u_start) / (skin.u_max - u_start)
        return front_height * np.clip(1 - share, 0, 1) * np.ones_like(v)

    return _cap(skin, height, np.linspace(u_start, skin.u_max, rows + 1), columns)


def _cap(
    skin: Skin, height: Callable[[Floats, Floats], Floats], rows: Floats, columns: int
) -> TriangleMesh:
    u, v = (g.ravel() for g in np.meshgrid(rows, np.linspace(0, 1, columns + 1), indexing="ij"))

    def place(a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
        a = np.clip(a, 0, skin.u_max)
        return a, b, height(a, b)

    positions, normals = skin.patch(place, u, v)
    pole = (u <= 0) | (u >= skin.u_max)
    positions[pole], normals[pole] = skin.points(u[pole], v[pole]), skin.normals(u[pole], v[pole])
    index = np.arange(len(u)).reshape(len(rows), columns + 1)
    faces = grid_faces(index)
    # at a pole one edge of each cell has no length
    at_pole = pole[faces].sum(axis=1) > 1
    return TriangleMesh(positions, normals, np.stack([u, v], axis=1), faces[~at_pole])


def strip(uv: Floats, front: Ints, rear: Ints) -> Ints:
    """Triangles between two rings of different numbers of vertices, each from v = 0 to v = 1."""
    triangles = []
    i = j = 0
    while i < len(front) - 1 or j < len(rear) - 1:
        ahead = uv[front[i + 1], 1] if i < len(front) - 1 else np.inf
        behind = uv[rear[j + 1], 1] if j < len(rear) - 1 else np.inf
        if ahead < behind:
            triangles.append((front[i], rear[j], front[i + 1]))
            i += 1
        else:
            triangles.append((front[i], rear[j], rear[j + 1]))
            j += 1
    return np.array(triangles)


def eyes(skin: Skin, rows: int = 20, columns: int = 32) -> TriangleMesh:
    """Two eyeballs; u = 0 in the middle of the pupil, 1 at the back of the eye; v around."""
    x, d = EYE
    size = skin.anatomy.head_length
    along = np.linspace(0, skin.u_max, 20001)
    u = np.interp(x * size, skin.arc(along[along < 2]), along[along < 2])
    radius = EYE_RADIUS * size
    balls = []
    for v in (0.5 - d, 0.5 + d):
        at, around = np.array([u]), np.array([v])
        out = skin.normals(at, around)[0]
        centre = skin.points(at, around)[0] - 0.62 * radius * out
        first = skin.tangent(at)[0]
        first = first - (first @ out) * out
        first /= np.linalg.norm(first)
        second = np.cross(out, first)
        polar, azimuth = np.meshgrid(
            np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij"
        )
        sine = np.sin(polar)
        parts = np.stack([np.cos(polar), sine * np.cos(azimuth), sine * np.sin(azimuth)], axis=-1)
        normals = parts.reshape(-1, 3) @ np.stack([out, first, second])
        index = np.arange(polar.size).reshape(rows + 1, columns + 1)
        faces = grid_faces(index)
        # at each pole one triangle of every cell has no area
        cells = columns * rows
        faces = np.concatenate([faces[: cells - columns], faces[cells + columns :]])
        uv = np.stack([polar / np.pi, azimuth / (2 * np.pi)], axis=-1).reshape(-1, 2)
        balls.append(TriangleMesh(centre + radius * normals, normals, uv, faces))
    return join(balls)


def join(meshes: list[TriangleMesh]) -> TriangleMesh:
    """Join meshes into one, without welding; an orientation is kept where all have one."""
    starts = np.cumsum([0] + [len(mesh.positions) for mesh in meshes])
    turns = [mesh.orientation for mesh in meshes if mesh.orientation is not None]
    return TriangleMesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
        np.concatenate(turns) if len(turns) == len(meshes) else None,
    )
