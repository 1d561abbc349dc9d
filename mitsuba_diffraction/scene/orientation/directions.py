"""Smooth fields of tangent directions on any triangle mesh, with or without texture coordinates.

A direction at a vertex is a complex number z in a frame of its tangent plane. Neighbours agree
where z_i = r_ij z_j, with r_ij the rotation that carries one frame into the other, so that

    E(z) = Σ w_ij |z_i − r_ij z_j|² = zᴴ L z

measures how much a field turns; L is the connection Laplacian, w the cotangent weights. The
smoothest field is its lowest eigenvector, and one that follows a guide q within a distance ℓ solves
(L + M/ℓ²) z = (M/ℓ²) q, M the vertices' areas (Knöppel, Crane, Pinkall and Schröder 2013, *Globally
optimal direction fields*, sections 3 and 6.2, for n = 1).

On a closed surface that is no torus every field has singular points, around which it turns once:
their indices add up to the Euler characteristic (Poincaré and Hopf), 2 for a ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu

from ...errors import DiffractionError
from .surface import Surface

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

#: What a field may follow.
GUIDES = ("smooth", "x", "y", "z", "body")
_ITERATIONS = 60
_SHIFT = 1e-6  # of the eigenvalues' scale: the Laplacian of a flat sheet is singular


@dataclass(frozen=True)
class DirectionField:
    """A unit tangent vector for every vertex, and where there is none."""

    # (n, 3) unit vectors at right angles to the normals; zero where there is none
    directions: Floats
    singular: Floats  # (k, 3) places around which the field turns
    indices: Ints  # (k,) how often, counter-clockwise


def direction_field(
    positions: Floats,
    normals: Floats,
    faces: Ints,
    along: str = "smooth",
    *,
    smoothing: float = 0.03,
) -> DirectionField:
    """A smooth field of tangent directions.

    Parameters
    ----------
    positions, normals : (n, 3); vertices at one place are one, so seams of textures do not matter.
    faces : (m, 3).
    along
        `smooth`: the field that turns least. `x`, `y`, `z`: that axis, laid onto the surface.
        `body`: from one end of each part to the other, the way a current flows from tip to tip.
    smoothing : distance within which a field may leave its guide, as a share of the mesh's size.

    Raises
    ------
    DiffractionError
        If `along` or `smoothing` is none of these, or the mesh has no area or is not finite.
    """
    if along not in GUIDES:
        raise DiffractionError(f"along={along!r} is unknown; choose one of {', '.join(GUIDES)}")
    if not 1e-4 <= smoothing <= 1.0:
        raise DiffractionError(f"directions: smoothing = {smoothing:g} is outside 0.0001 to 1")
    lost = np.flatnonzero(~np.isfinite(np.hstack([positions, normals])).all(axis=1))
    if len(lost):
        raise DiffractionError(
            f"mesh: the position or normal of vertex {lost[0]} is not finite ({len(lost)} such "
            "vertices); repair the mesh"
        )
    surface = Surface.weld(positions, normals, faces)
    if along == "smooth":
        field = _smoothest(surface)
    else:
        size = float(np.ptp(surface.positions, axis=0).max())
        guide = _current(surface) if along == "body" else np.eye(3)["xyz".index(along)]
        field = _following(surface, surface.complex_of(guide), smoothing * size)
    length = np.abs(field)
    unit = field / np.where(length > 0, length, 1.0)
    indices = surface.indices(unit)
    singular = np.flatnonzero(indices)
    spread = surface.vectors_of(unit)[surface.welded]
    spread -= (spread * normals).sum(axis=1, keepdims=True) * normals
    size_of = np.linalg.norm(spread, axis=1, keepdims=True)
    return DirectionField(
        spread / np.where(size_of > 0, size_of, 1.0),
        surface.positions[surface.faces[singular]].mean(axis=1),
        indices[singular],
    )


def turned(directions: Floats, normals: Floats, degrees: float) -> Floats:
    """Directions (n, 3) turned around their normals, counter-clockwise seen from outside."""
    angle = np.radians(degrees)
    return np.cos(angle) * directions + np.sin(angle) * np.cross(normals, directions)


def _smoothest(surface: Surface) -> Complexes:
    """The lowest eigenvector of L z = λ M z on each connected part, by inverse iteration."""
    count, part = surface.parts()
    laplacian, mass = surface.connection_laplacian(), surface.areas
    shift = _SHIFT * laplacian.diagonal().real.sum() / mass.sum()
    solve = splu(csc_array(laplacian + diags_array(shift * mass))).solve
    rng = np.random.default_rng(0)
    field = rng.normal(size=(2, len(mass))).T @ np.array([1, 1j])
    for _ in range(_ITERATIONS):
        field = solve(mass * field)
        norm = np.sqrt(np.bincount(part, mass * np.abs(field) ** 2, count))
        field /= np.maximum(norm, 1e-300)[part]
    return field


def _following(surface: Surface, guide: Complexes, distance: float) -> Complexes:
    """The field that follows a guide where it has a length, smooth within a distance."""
    mass = surface.areas / distance**2
    matrix = csc_array(surface.connection_laplacian() + diags_array(mass.astype(np.complex128)))
    return splu(matrix).solve(mass * guide)


def _current(surface: Surface) -> Floats:
    """Unit vectors along the current from one end of each part to the other, (k, 3)."""
    count, part = surface.parts()
    n = len(surface.positions)
    i, j = surface.edges.T
    length = np.linalg.norm(surface.positions[i] - surface.positions[j], axis=1)
    graph = csr_array(coo_array((length, (i, j)), shape=(n, n)))
    source = np.zeros(n)
    for number in range(count):
        inside = np.flatnonzero(part == number)
        if len(inside) < 3:
            continue
        # the farthest place from anywhere is one end, the farthest from there the other
        start = inside[0]
        ends = []
        for _ in range(2):
            away = dijkstra(graph, directed=False, indices=start)[inside]
            start = inside[np.argmax(away)]
            ends.append(start)
        source[ends[0]], source[ends[1]] = -1.0, 1.0
    laplacian = surface.laplacian(1.0)
    small = _SHIFT * laplacian.diagonal().sum() / n
    potential = splu(csc_array(laplacian + diags_array(np.full(n, small)))).solve(source)
    return surface.gradient(potential)
