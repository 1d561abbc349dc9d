"""A mesh welded by position as discrete geometry: frames, transport, Laplacians, gradients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.csgraph import connected_components

from ...errors import DiffractionError
from .tangents import carried

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Surface:
    """A mesh welded by position, with frames, transport along its edges, weights and areas."""

    positions: Floats
    faces: Ints
    welded: Ints  # (n,) from the given vertices to these
    frames: Floats  # (k, 2, 3) two unit vectors at right angles to the normal
    normals: Floats
    edges: Ints  # (e, 2)
    weights: Floats
    areas: Floats

    @classmethod
    def weld(cls, positions: Floats, normals: Floats, faces: Ints) -> Surface:
        places, welded = np.unique(positions, axis=0, return_inverse=True)
        welded = welded.reshape(-1)
        faces = welded[faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        corners = places[faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        double = np.linalg.norm(across, axis=1)
        faces, corners, double = faces[double > 0], corners[double > 0], double[double > 0]
        if not len(faces):
            raise DiffractionError("mesh: no triangle has an area, so there is no direction on it")
        up = np.zeros_like(places)
        np.add.at(up, welded, normals)
        size = np.linalg.norm(up, axis=1, keepdims=True)
        up = np.where(size > 1e-6, up / np.maximum(size, 1e-6), [0.0, 0.0, 1.0])
        # the coordinate axis that lies flattest gives the frame
        axis = np.eye(3)[np.abs(up).argmin(axis=1)]
        first = axis - (axis * up).sum(axis=1, keepdims=True) * up
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        frames = np.stack([first, np.cross(up, first)], axis=1)

        pairs, cotangents = [], []
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # the angle at c is opposite to a–b
            one, two = corners[:, a] - corners[:, c], corners[:, b] - corners[:, c]
            pairs.append(faces[:, [a, b]])
            cotangents.append((one * two).sum(axis=1) / double)
        edges, inverse = np.unique(np.sort(np.concatenate(pairs)), axis=0, return_inverse=True)
        weights = np.zeros(len(edges))
        np.add.at(weights, inverse.reshape(-1), np.concatenate(cotangents) / 2)
        # obtuse triangles make some negative: a small positive weight keeps the energy one
        weights = np.maximum(weights, 1e-2)
        areas = np.zeros(len(places))
        np.add.at(areas, faces.ravel(), np.repeat(double / 6, 3))
        areas = np.maximum(areas, 1e-9 * areas.max())  # vertices that no triangle uses
        return cls(places, faces, welded, frames, up, edges, weights, areas)

    def transport(self, to: Ints, origin: Ints) -> Complexes:
        """Rotations (e,) from the frames at `origin` to those at `to`, the normals' tilt apart."""
        laid_over = carried(self.frames[origin, 0], self.normals[origin], self.normals[to])
        x, y = ((laid_over * self.frames[to, n]).sum(axis=1) for n in (0, 1))
        rotation = x + 1j * y
        length = np.abs(rotation)
        return np.where(length > 1e-6, rotation / np.maximum(length, 1e-6), 1.0)

    def laplacian(self, rotation: Complexes | float) -> csc_array:
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

    def parts(self) -> tuple[int, Ints]:
        """Number of connected parts, and of which one each vertex is."""
        n = len(self.positions)
        ones = np.ones(len(self.edges))
        count, label = connected_components(coo_array((ones, tuple(self.edges.T)), shape=(n, n)))
        return int(count), label

    def complex_of(self, vectors: Floats) -> Complexes:
        """Vectors, one or (k, 3), in the frames: their tangential parts."""
        x, y = ((self.frames[:, n] * vectors).sum(axis=1) for n in (0, 1))
        return x + 1j * y

    def vectors_of(self, field: Complexes) -> Floats:
        """The inverse of `complex_of`, (k, 3)."""
        return field.real[:, None] * self.frames[:, 0] + field.imag[:, None] * self.frames[:, 1]

    def indices(self, field: Complexes) -> Ints:
        """How often a field turns around each triangle, counter-clockwise seen from its front."""
        turn = np.zeros(len(self.faces))
        holonomy = np.ones(len(self.faces), dtype=np.complex128)
        for a, b in ((0, 1), (1, 2), (2, 0)):
            i, j = self.faces[:, a], self.faces[:, b]
            rotation = self.transport(j, i)
            turn += np.angle(field[j] * np.conj(rotation * field[i]))
            holonomy *= rotation
        # what is carried once around comes back turned by the curvature within
        return np.round((turn + np.angle(holonomy)) / (2 * np.pi)).astype(np.int64)

    def gradient(self, values: Floats) -> Floats:
        """Unit vectors along the gradient of a function that is linear on the triangles, (k, 3)."""
        corners, at = self.positions[self.faces], values[self.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        squared = (across**2).sum(axis=1, keepdims=True)
        rising = np.zeros_like(across)
        for n in range(3):
            opposite = corners[:, (n + 2) % 3] - corners[:, (n + 1) % 3]
            rising += at[:, n, None] * np.cross(across, opposite) / squared
        total = np.zeros_like(self.positions)
        for n in range(3):
            np.add.at(total, self.faces[:, n], rising * np.sqrt(squared))
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return total / np.where(length > 0, length, 1.0)
