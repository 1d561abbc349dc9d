"""Meshes whose fields of directions are known, and mesh files of a few lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from mitsuba_diffraction.scene.orientation import grid_faces

#: Positions, unit normals and triangles.
Arrays = tuple[np.ndarray, np.ndarray, np.ndarray]


def wrapped(n: int, m: int) -> Arrays:
    """Angles (i, j) over a grid whose ends meet, and its triangles."""
    i, j = np.meshgrid(
        np.linspace(0, 2 * np.pi, n + 1), np.linspace(0, 2 * np.pi, m + 1), indexing="ij"
    )
    return i.ravel(), j.ravel(), grid_faces(np.arange(i.size).reshape(n + 1, m + 1))


def _seamless(positions: np.ndarray, normals: np.ndarray, faces: np.ndarray) -> Arrays:
    # so that both ends of a seam are the same numbers
    return np.round(positions, 9) + 0.0, normals, faces


def ball(n: int = 20) -> Arrays:
    """A sphere of radius 1 around 0, whose poles are on the z axis."""
    i, j, faces = wrapped(n, 2 * n)
    p = np.stack([np.sin(i / 2) * np.cos(j), np.sin(i / 2) * np.sin(j), np.cos(i / 2)], axis=1)
    return _seamless(p, p, faces)


def ring(
    n: int = 40, m: int = 20, *, radii: tuple[float, float] = (2.0, 0.7), part: float = 1.0
) -> Arrays:
    """A torus around z, or a part of it, which is open."""
    i, j, faces = wrapped(n, m)
    i = part * i
    out = np.stack([np.cos(i), np.sin(i), 0 * i], axis=1)
    normals = np.cos(j)[:, None] * out + np.sin(j)[:, None] * np.array([0.0, 0.0, 1.0])
    return _seamless(radii[0] * out + radii[1] * normals, normals, faces)


def tube(n: int, m: int) -> Arrays:
    """An open cylinder around z of radius 1 and height 3; the x axis is between vertices."""
    i, j, faces = wrapped(n, m)
    angle = i + np.pi / n
    normals = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return _seamless(normals + np.outer(3.0 * j / (2 * np.pi), [0.0, 0.0, 1.0]), normals, faces)


def obj_of(
    path: Path,
    positions: ArrayLike,
    polygons: Iterable[Sequence[int]],
    uv: Sequence[Sequence[float]] = (),
    uv_polygons: Iterable[Sequence[int]] | None = None,
) -> None:
    """Write an OBJ without normals; polygons name positions, and `uv_polygons` coordinates."""
    rows = [["v", *row] for row in np.asarray(positions).tolist()]
    rows += [["vt", *row] for row in np.array(uv).tolist()]
    placed = uv_polygons or polygons
    for ends in (zip(*pair, strict=True) for pair in zip(polygons, placed, strict=True)):
        rows.append(["f", *(f"{v + 1}/{t + 1}" if len(uv) else v + 1 for v, t in ends)])
    path.write_text("\n".join([*(" ".join(map(str, row)) for row in rows), ""]))


def ply_text(vertices: ArrayLike, polygons: Sequence[Sequence[int]], names: Sequence[str]) -> str:
    """Return a PLY in text, whose vertices have numbers of these names."""
    rows = np.asarray(vertices).tolist()
    header = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(polygons)}", "property list uchar int vertex_indices"]
    rows += [[len(polygon), *polygon] for polygon in polygons]
    return "\n".join([*header, "end_header", *(" ".join(map(str, row)) for row in rows), ""])
