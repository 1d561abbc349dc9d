"""A grid of directions, and bilinear interpolation on it (NumPy only)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

Real = NDArray[np.float64]

#: The grid ends at this polar angle; what is beyond is as there.
LAST_ANGLE = math.radians(89.5)
#: x = (1 − √(1 − 2θ/π)) / SHARE runs from 0 to 1 over the grid: denser towards grazing angles.
SHARE = 1.0 - math.sqrt(1.0 - LAST_ANGLE / (0.5 * math.pi))


@dataclass(frozen=True)
class DirectionGrid:
    """`polar` + 1 polar angles, from 0 to `LAST_ANGLE`, and `azimuthal` azimuths from 0.

    Values on it have the shape (polar + 1, azimuthal).
    """

    polar: int
    azimuthal: int

    @property
    def theta(self) -> Real:
        """Polar angles, rad, (polar + 1,)."""
        position = np.arange(self.polar + 1) / self.polar
        return np.asarray(0.5 * math.pi * (1.0 - (1.0 - SHARE * position) ** 2))

    @property
    def phi(self) -> Real:
        """Azimuths, rad, (azimuthal,)."""
        return np.asarray(np.arange(self.azimuthal) * (2.0 * math.pi / self.azimuthal), np.float64)

    def row(self, theta: ArrayLike) -> Real:
        """Position 0 … polar of a polar angle (rad)."""
        remaining = np.maximum(1.0 - np.asarray(theta, float) / (0.5 * math.pi), 0.0)
        return np.clip((1.0 - np.sqrt(remaining)) * (self.polar / SHARE), 0.0, self.polar)

    def interpolation(self, theta: ArrayLike, phi: ArrayLike) -> Interpolation:
        """From values on the grid to directions (rad), of any one shape."""
        row, column = np.broadcast_arrays(
            self.row(theta), np.mod(phi, 2.0 * math.pi) * (self.azimuthal / (2.0 * math.pi))
        )
        i = np.minimum(row.astype(np.int32), self.polar - 1)
        j = column.astype(np.int32)
        s, t = (row - i).astype(np.float32), (column - j).astype(np.float32)
        j %= self.azimuthal
        index = i * self.azimuthal + j
        right = i * self.azimuthal + (j + 1) % self.azimuthal
        nodes = (self.polar + 1) * self.azimuthal
        return Interpolation(index, right, self.azimuthal, nodes, s, t)


@dataclass(frozen=True)
class Interpolation:
    """Bilinear, from values on `nodes` of the grid: four are read for each direction."""

    left: NDArray[np.int32]
    right: NDArray[np.int32]
    stride: int
    nodes: int
    s: NDArray[np.float32]
    t: NDArray[np.float32]

    def __call__(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values at the directions."""
        return np.asarray((self._matrix @ values.ravel()).reshape(self.left.shape))

    def spread(self, values: NDArray[np.floating]) -> Real:
        """The transposed: values at the directions, by their shares in the nodes (nodes,)."""
        return np.asarray(self._matrix.T @ values.ravel(), np.float64)

    def largest(self, values: NDArray[np.floating]) -> Real:
        """The largest of the values, at least 1, that each node (nodes,) has a share in."""
        found = np.ones(self.nodes)
        much = np.flatnonzero(values.ravel() > 1.0)
        shared = self._matrix[much]
        at = shared.data > 1e-3
        of = np.repeat(values.ravel()[much], 4)
        np.maximum.at(found, shared.indices[at], of[at])
        return found

    def summed(self, shares: NDArray[np.float32]) -> Summed:
        """Sums over the last axis of the directions, by shares (…, m)."""
        data = self._matrix.data * np.repeat(shares.ravel(), 4)
        starts = np.arange(0, len(data) + 1, 4 * shares.shape[-1], dtype=np.int32)
        shape = len(starts) - 1, self.nodes
        matrix = sparse.csr_array((data, self._matrix.indices, starts), shape=shape)
        return Summed(matrix, shares.shape[:-1])

    @cached_property
    def _matrix(self) -> sparse.csr_array:
        """(directions, nodes)."""
        columns = [at + step for step in (0, self.stride) for at in (self.left, self.right)]
        shares = [s * t for s in (1.0 - self.s, self.s) for t in (1.0 - self.t, self.t)]
        indices, data = (np.stack(part, axis=-1).ravel() for part in (columns, shares))
        starts = np.arange(0, len(data) + 1, 4, dtype=np.int32)
        return sparse.csr_array((data, indices, starts), shape=(self.left.size, self.nodes))


@dataclass(frozen=True)
class Summed:
    """A linear map from values on a grid: `matrix` (sums, nodes), of sums of a shape."""

    matrix: sparse.csr_array
    shape: tuple[int, ...]

    def __call__(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """The sums."""
        return np.asarray((self.matrix @ values.ravel()).reshape(self.shape))
