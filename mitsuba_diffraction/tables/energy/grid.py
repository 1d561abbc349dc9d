"""A grid of directions, and bilinear interpolation on it (NumPy only)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
        return Interpolation(index, right, self.azimuthal, s, t)


@dataclass(frozen=True)
class Interpolation:
    """Bilinear: of values on the grid, four are read for each direction."""

    left: NDArray[np.int32]
    right: NDArray[np.int32]
    stride: int
    s: NDArray[np.float32]
    t: NDArray[np.float32]

    def __call__(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values at the directions."""
        flat = np.ascontiguousarray(values).ravel()
        low, high = (
            flat.take(self.left + d) * (1.0 - self.t) + flat.take(self.right + d) * self.t
            for d in (0, self.stride)
        )
        return np.asarray(low * (1.0 - self.s) + high * self.s)

    def spread(self, values: NDArray[np.floating], shape: tuple[int, int]) -> Real:
        """The transposed: values at the directions, by their shares in the nodes."""
        sums = (
            np.bincount(at.ravel(), (share * values).ravel(), math.prod(shape))
            for at, share in self._nodes()
        )
        return np.asarray(sum(sums)).reshape(shape)

    def largest(self, values: NDArray[np.floating], shape: tuple[int, int]) -> Real:
        """The largest of the values, at least 1, that each node has a share in."""
        found = np.ones(math.prod(shape))
        for at, share in self._nodes():
            np.maximum.at(found, at.ravel(), np.where(share > 1e-3, values, 1.0).ravel())
        return found.reshape(shape)

    def _nodes(self) -> Iterator[tuple[NDArray[np.int32], NDArray[np.float32]]]:
        """All four, and their shares."""
        for step, s in ((0, 1.0 - self.s), (self.stride, self.s)):
            yield self.left + step, s * (1.0 - self.t)
            yield self.right + step, s * self.t
