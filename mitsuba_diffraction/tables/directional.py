"""Functions of direction on a grid, linear in between, and of wavelength (NumPy only)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arrays import Real, Single
from ..optics.geometry import LAST_ANGLE

#: x = (1 − √(1 − 2θ/π)) / SHARE runs from 0 to 1 over the grid: denser towards grazing angles.
SHARE = 1.0 - math.sqrt(1.0 - LAST_ANGLE / (0.5 * math.pi))


@dataclass(frozen=True)
class DirectionGrid:
    """Grid of `polar` + 1 polar angles, from 0 to `LAST_ANGLE`, and `azimuthal` azimuths from 0.

    Values on it have the shape (polar + 1, azimuthal); those at its end hold beyond.
    """

    polar: int
    azimuthal: int

    @property
    def theta(self) -> Real:
        """Polar angles, rad, (polar + 1,)."""
        return self.angles(np.arange(self.polar + 1))

    @property
    def phi(self) -> Real:
        """Azimuths, rad, (azimuthal,)."""
        return np.asarray(np.arange(self.azimuthal) * (2.0 * math.pi / self.azimuthal), np.float64)

    @property
    def ones(self) -> Single:
        """Weights of 1."""
        return np.ones((self.polar + 1, self.azimuthal), np.float32)

    @property
    def half(self) -> DirectionGrid:
        """Grid of half as many cells, for smooth quantities."""
        return DirectionGrid(min(self.polar // 2, 24), min(self.azimuthal // 2, 30))

    def angles(self, row: ArrayLike) -> Real:
        """Polar angles (rad) at rows 0 … polar."""
        position = np.asarray(row, float) / self.polar
        return np.asarray(0.5 * math.pi * (1.0 - (1.0 - SHARE * position) ** 2))

    def row(self, theta: ArrayLike) -> Real:
        """Row 0 … polar of polar angles (rad)."""
        remaining = np.maximum(1.0 - np.asarray(theta, float) / (0.5 * math.pi), 0.0)
        return np.clip((1.0 - np.sqrt(remaining)) * (self.polar / SHARE), 0.0, self.polar)

    def middles(self, parts: int) -> tuple[Real, Real]:
        """Middles of the parts of all cells: polar angles and azimuths, rad."""
        theta = self.angles((np.arange(self.polar * parts) + 0.5) / parts)
        count = self.azimuthal * parts
        return theta, np.asarray((np.arange(count) + 0.5) * (2.0 * math.pi / count))

    def turns(self, phi: Real) -> Turns:
        """Return the turns of the grid by azimuths (n,), rad."""
        cells = np.round(np.mod(phi, 2.0 * math.pi) * (self.azimuthal / (2.0 * math.pi)), 9)
        whole = np.floor(cells).astype(np.int64)
        offsets, which = np.unique(cells - whole, return_inverse=True)
        offsets *= 2.0 * math.pi / self.azimuthal
        members = [np.flatnonzero(which == n) for n in range(len(offsets))]
        return Turns(list(zip(offsets.tolist(), members, strict=True)), whole)

    def interpolation(self, theta: ArrayLike, phi: ArrayLike) -> LinearMap:
        """Bilinear interpolation to directions (rad), of any one shape."""
        row, column = np.broadcast_arrays(
            self.row(theta), np.mod(phi, 2.0 * math.pi) * (self.azimuthal / (2.0 * math.pi))
        )
        i = np.minimum(row.astype(np.int32), self.polar - 1)
        j = column.astype(np.int32)
        s, t = (row - i).astype(np.float32), (column - j).astype(np.float32)
        left = i * self.azimuthal + j % self.azimuthal
        right = i * self.azimuthal + (j + 1) % self.azimuthal
        columns = [at + step for step in (0, self.azimuthal) for at in (left, right)]
        shares = [u * v for u in (1.0 - s, s) for v in (1.0 - t, t)]
        indices, data = (np.stack(part, axis=-1).ravel() for part in (columns, shares))
        starts, nodes = np.arange(0, len(data) + 1, 4), (self.polar + 1) * self.azimuthal
        corners = scipy.sparse.csr_array((data, indices, starts), shape=(row.size, nodes))
        return LinearMap(corners, row.shape)


class Turns(NamedTuple):
    """Turns (n,) of a grid about the normal.

    offsets : turns by less than a cell, rad, each with the places 0 … n − 1 that have it.
    cells : by which the grid is turned, (n,).
    """

    offsets: list[tuple[float, NDArray[np.integer]]]
    cells: NDArray[np.integer]

    def seen(self, values: Single) -> Single:
        """Values on the grid as they are seen from the turned ones, (n, nodes)."""
        columns = (self.cells[:, None] + np.arange(values.shape[-1])) % values.shape[-1]
        return np.take(values, columns, axis=-1).swapaxes(0, 1).reshape(len(columns), -1)


@dataclass(frozen=True)
class LinearMap:
    """Map from values on a grid to values of another shape: `matrix` (values, nodes)."""

    matrix: scipy.sparse.csr_array
    shape: tuple[int, ...]

    def __call__(self, values: NDArray[np.floating]) -> Single:
        return np.asarray((self.matrix @ values.ravel()).reshape(self.shape))

    def summed(self, shares: Single) -> LinearMap:
        """Return the map to sums over the last axis, by shares (…, m)."""
        return self.summed_in(np.full(shares.shape[:-1], shares.shape[-1]), shares)

    def summed_in(self, counts: NDArray[np.integer], shares: Single) -> LinearMap:
        """Return the map to sums by shares, of as many values in a row as `counts` (…) has."""
        corners = self.matrix
        data = corners.data * np.repeat(shares.ravel(), 4)
        starts = 4 * np.concatenate([[0], np.cumsum(counts)])
        rows = scipy.sparse.csr_array(
            (data, corners.indices, starts), shape=(counts.size, corners.shape[1])
        )
        return LinearMap(rows, counts.shape)


@dataclass(frozen=True)
class DirectionalTable:
    """Function of wavelength and direction.

    Attributes
    ----------
    wavelengths : (n,) nm, evenly in their logarithm.
    values : (n, polar + 1, azimuthal) on a `DirectionGrid`.
    """

    wavelengths: Real
    values: Single

    @property
    def grid(self) -> DirectionGrid:
        """Directions of the values."""
        return DirectionGrid(self.values.shape[1] - 1, self.values.shape[2])

    def at(self, theta: ArrayLike, phi: ArrayLike, wavelength: float) -> Single:
        """Interpolate at angles (rad) of any one shape and a wavelength (nm)."""
        return self.grid.interpolation(theta, phi)(self.page(wavelength))

    def on(self, grid: DirectionGrid) -> DirectionalTable:
        """Interpolate to another grid of directions."""
        to_grid = self.grid.interpolation(grid.theta[:, None], grid.phi)
        return DirectionalTable(self.wavelengths, np.stack([to_grid(page) for page in self.values]))

    def page(self, wavelength: float) -> Single:
        """Values at one wavelength (nm)."""
        place = np.interp(
            np.log(wavelength), np.log(self.wavelengths), np.arange(len(self.wavelengths))
        )
        low = int(min(place, len(self.wavelengths) - 2)) if len(self.wavelengths) > 1 else 0
        high = min(low + 1, len(self.wavelengths) - 1)
        share = np.float32(place - low)
        return np.asarray(self.values[low] * (1 - share) + self.values[high] * share, np.float32)


#: Grid that renderers without wavelengths look scales up on.
FINE = DirectionGrid(40, 60)


class Quadrature(NamedTuple):
    """Quadrature over the hemisphere: directions (n,), angles in rad, and their solid angles."""

    x: Real
    y: Real
    cosine: Real
    theta: Real
    azimuth: Real
    weights: Real


@lru_cache(maxsize=8)
def quadrature(rings: int, widest: int, sine: float = 1.0, *, upper: bool = False) -> Quadrature:
    """Place directions on rings, with `widest` azimuths on the widest.

    sine : of an angle that has so many rings on either side.
    upper : only directions of y > 0, with as many of y < 0 opposite.
    """
    position, share = np.polynomial.legendre.leggauss(rings)
    ends = sorted({0.0, math.asin(sine), 0.5 * math.pi})
    halves = 0.5 * np.diff(ends)[:, None]
    angles = (np.array(ends[:-1])[:, None] + halves * (position + 1.0)).ravel()
    share = (share * halves).ravel()
    steps = np.maximum(8, np.rint(widest * np.sin(angles)).astype(int))
    steps += steps % 2 if upper else 0
    theta, count = np.repeat(angles, steps), np.repeat(steps, steps)
    # rings are turned against each other, or symmetric
    starts = np.full(len(steps), 0.5) if upper else 0.381966 * np.arange(len(steps))
    turn = np.concatenate([np.arange(n) + start for start, n in zip(starts, steps, strict=True)])
    azimuth = np.mod(turn * 2.0 * np.pi / count + np.pi, 2.0 * np.pi) - np.pi
    weights = np.repeat(share, steps) * np.sin(theta) * 2.0 * np.pi / count
    x, y = np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth)
    nodes = x, y, np.cos(theta), theta, azimuth, weights
    return Quadrature(*(part[y > 0.0] if upper else part for part in nodes))
