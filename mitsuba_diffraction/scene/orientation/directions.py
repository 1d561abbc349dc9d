"""Smooth fields of tangent directions on any triangle mesh, with or without texture coordinates.

A direction at a vertex is a complex number z in a frame of its tangent plane. Neighbours agree
where z_i = r_ij z_j, with r_ij the rotation that carries one frame into the other, so that

    E(z) = Σ w_ij |z_i − r_ij z_j|² = zᴴ L z

measures how much a field turns; L is the connection Laplacian, w the cotangent weights. The
smoothest field is its lowest eigenvector, and one that follows a guide q within a distance ℓ solves
(L + M/ℓ²) z = (M/ℓ²) q, M the vertices' areas (Knöppel, Crane, Pinkall and Schröder 2013, *Globally
optimal direction fields*, sections 3 and 6.2, for n = 1).

On a closed surface other than a torus every field has singular points, around which it turns once:
their indices add up to the Euler characteristic (Poincaré and Hopf), 2 for a ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.sparse.linalg import splu

from ...arrays import Complex, Real, Whole
from ...errors import DiffractionError, check_choice
from .tangents import carried
from .trimesh import across, check_finite, tangential, unit

#: Guides that a field may follow.
GUIDES = ("smooth", "x", "y", "z", "body")
_ITERATIONS = 60
_SHIFT = 1e-6  # share of the eigenvalues' scale: the Laplacian of a flat sheet is singular


@dataclass(frozen=True)
class WeldedMesh:
    """A mesh welded by position, with frames, transport along its edges, weights and areas."""

    positions: Real
    faces: Whole
    welded: Whole  # (n,) from the given vertices to these
    frames: Real  # (k, 2, 3) two unit vectors at right angles to the normal
    normals: Real
    edges: Whole  # (e, 2)
    weights: Real
    areas: Real

    @classmethod
    def weld(cls, positions: Real, normals: Real, faces: Whole) -> WeldedMesh:
        places, welded = np.unique(positions, axis=0, return_inverse=True)
        welded = welded.reshape(-1)
        faces = welded[faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        corners = places[faces]
        double = np.linalg.norm(across(corners), axis=1)
        faces, corners, double = faces[double > 0], corners[double > 0], double[double > 0]
        if not len(faces):
            raise DiffractionError("mesh: no triangle has an area, so there is no direction on it")
        up = np.zeros_like(places)
        np.add.at(up, welded, normals)
        size = np.linalg.norm(up, axis=1, keepdims=True)
        up = np.where(size > 1e-6, up / np.maximum(size, 1e-6), [0.0, 0.0, 1.0])
        # the coordinate axis that lies flattest gives the frame
        axis = np.eye(3)[np.abs(up).argmin(axis=1)]
        first = tangential(axis, up)
        frames = np.stack([first, np.cross(up, first)], axis=1)

        pairs, cotangents = [], []
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # the angle at c is opposite to a–b
            first, second = corners[:, a] - corners[:, c], corners[:, b] - corners[:, c]
            pairs.append(faces[:, [a, b]])
            cotangents.append((first * second).sum(axis=1) / double)
        edges, inverse = np.unique(np.sort(np.concatenate(pairs)), axis=0, return_inverse=True)
        weights = np.bincount(inverse.reshape(-1), np.concatenate(cotangents) / 2, len(edges))
        areas = np.bincount(faces.ravel(), np.repeat(double / 6, 3), len(places))
        return cls(
            places, faces, welded, frames, up, edges,
            # obtuse triangles make some negative: a small positive weight keeps the energy one
            np.maximum(weights, 1e-2),
            np.maximum(areas, 1e-9 * areas.max()),  # vertices that no triangle uses
        )  # fmt: skip

    def transport(self, to: Whole, origin: Whole) -> Complex:
        """Rotations (e,) from the frames at `origin` to those at `to`, the normals' tilt apart."""
        laid_over = carried(self.frames[origin, 0], self.normals[origin], self.normals[to])
        x, y = ((laid_over * self.frames[to, n]).sum(axis=1) for n in (0, 1))
        rotation = x + 1j * y
        length = np.abs(rotation)
        return np.where(length > 1e-6, rotation / np.maximum(length, 1e-6), 1.0)

    def laplacian(self, rotation: Complex | float) -> csc_array:
        """Σ w |z_i − r_ij z_j|² as a Hermitian matrix; r of the edges from second to first."""
        i, j = self.edges.T
        off = -self.weights * rotation
        n = len(self.positions)
        rows, columns = np.concatenate([i, j]), np.concatenate([j, i])
        diagonal = np.bincount(rows, np.tile(self.weights, 2), n)
        matrix = coo_array((np.concatenate([off, np.conj(off)]), (rows, columns)), shape=(n, n))
        return csc_array(matrix + diags_array(diagonal))

    def connection_laplacian(self) -> csc_array:
        i, j = self.edges.T
        return self.laplacian(self.transport(i, j))

    def parts(self) -> tuple[int, Whole]:
        """Number of connected parts, and of which one each vertex is."""
        n = len(self.positions)
        ones = np.ones(len(self.edges))
        count, label = connected_components(coo_array((ones, tuple(self.edges.T)), shape=(n, n)))
        return int(count), label

    def complex_of(self, vectors: Real) -> Complex:
        """Vectors, one or (k, 3), in the frames: their tangential parts."""
        x, y = ((self.frames[:, n] * vectors).sum(axis=1) for n in (0, 1))
        return x + 1j * y

    def vectors_of(self, field: Complex) -> Real:
        """The inverse of `complex_of`, (k, 3)."""
        return field.real[:, None] * self.frames[:, 0] + field.imag[:, None] * self.frames[:, 1]

    def indices(self, field: Complex) -> Whole:
        """How often a field turns around each triangle, counter-clockwise seen from its front."""
        turn = np.zeros(len(self.faces))
        holonomy = np.ones(len(self.faces), dtype=np.complex128)
        for a, b in ((0, 1), (1, 2), (2, 0)):
            i, j = self.faces[:, a], self.faces[:, b]
            rotation = self.transport(j, i)
            turn += np.angle(field[j] * np.conj(rotation * field[i]))
            holonomy *= rotation
        # a direction carried once around comes back turned by the curvature within
        return np.round((turn + np.angle(holonomy)) / (2 * np.pi)).astype(np.int64)

    def gradient(self, values: Real) -> Real:
        """Unit vectors along the gradient of a function that is linear on the triangles, (k, 3)."""
        corners, at = self.positions[self.faces], values[self.faces]
        normal = across(corners)
        squared = (normal**2).sum(axis=1, keepdims=True)
        rising = np.zeros_like(normal)
        for n in range(3):
            opposite = corners[:, (n + 2) % 3] - corners[:, (n + 1) % 3]
            rising += at[:, n, None] * np.cross(normal, opposite) / squared
        total = np.zeros_like(self.positions)
        np.add.at(total, self.faces, (rising * np.sqrt(squared))[:, None])
        return unit(total)


@dataclass(frozen=True)
class DirectionField:
    """Unit tangent vector of every vertex, and mask of vertices without one."""

    # (n, 3) unit vectors at right angles to the normals; zero without a direction
    directions: Real
    singular: Real  # (k, 3) places around which the field turns
    indices: Whole  # (k,) how often, counter-clockwise


def direction_field(
    positions: Real,
    normals: Real,
    faces: Whole,
    along: str = "smooth",
    *,
    smoothing: float = 0.03,
) -> DirectionField:
    """A smooth field of tangent directions.

    Raises a DiffractionError if `along` or `smoothing` is not one of these, or the mesh has no area
    or is not finite.

    Parameters
    ----------
    positions, normals : (n, 3); vertices at one place are one, so seams of textures do not matter.
    faces : (m, 3).
    along
        `smooth`: the field that turns least. `x`, `y`, `z`: that axis, laid onto the surface.
        `body`: from one end of each part to the other, the way a current flows from tip to tip.
    smoothing : distance within which a field may leave its guide, as a share of the mesh's size.
    """
    check_choice("along", along, GUIDES)
    if not 1e-4 <= smoothing <= 1.0:
        raise DiffractionError(f"directions: smoothing = {smoothing:g} is outside 0.0001 to 1")
    check_finite(np.hstack([positions, normals]), "mesh")
    surface = WeldedMesh.weld(positions, normals, faces)
    if along == "smooth":
        field = _smoothest(surface)
    else:
        size = float(np.ptp(surface.positions, axis=0).max())
        guide = _current(surface) if along == "body" else np.eye(3)["xyz".index(along)]
        field = _following(surface, surface.complex_of(guide), smoothing * size)
    length = np.abs(field)
    field /= np.where(length > 0, length, 1.0)
    indices = surface.indices(field)
    singular = np.flatnonzero(indices)
    return DirectionField(
        tangential(surface.vectors_of(field)[surface.welded], normals),
        surface.positions[surface.faces[singular]].mean(axis=1),
        indices[singular],
    )


def _smoothest(surface: WeldedMesh) -> Complex:
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


def _following(surface: WeldedMesh, guide: Complex, distance: float) -> Complex:
    """The field that follows a guide where it has a length, smooth within a distance."""
    mass = surface.areas / distance**2
    matrix = csc_array(surface.connection_laplacian() + diags_array(mass.astype(np.complex128)))
    return splu(matrix).solve(mass * guide)


def _current(surface: WeldedMesh) -> Real:
    """Unit vectors along the current from one end of each part to the other, (k, 3)."""
    _, part = surface.parts()
    n = len(surface.positions)
    i, j = surface.edges.T
    length = np.linalg.norm(surface.positions[i] - surface.positions[j], axis=1)
    graph = csr_array(coo_array((length, (i, j)), shape=(n, n)))
    source = np.zeros(n)
    # the farthest place from anywhere in a part is one end, the farthest from there the other
    _, ends = np.unique(part, return_index=True)
    for current in (-1.0, 1.0):
        away = dijkstra(graph, directed=False, indices=ends, min_only=True)
        order = np.lexsort([-away, part])
        ends = order[np.unique(part[order], return_index=True)[1]]
        source[ends] += current  # none of a vertex without triangles
    laplacian = surface.laplacian(1.0)
    small = _SHIFT * laplacian.diagonal().sum() / n
    potential = splu(csc_array(laplacian + diags_array(np.full(n, small)))).solve(source)
    return surface.gradient(potential)
