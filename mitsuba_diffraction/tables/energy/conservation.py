"""Energy conservation: a scale of directions by which no more is reflected than comes in.

The model f gains energy on some surfaces at some angles. With the albedo a(ω) of f at one
wavelength, s is sought such that

    f'(ωi, ωo) = f(ωi, ωo) s(ωi) s(ωo)   reflects   s(ωi) ∫ f s cosθo dωo = min(a(ωi), 1):

reciprocal, since s s is symmetric, and with nothing taken from directions that gain nothing, since
their s is a little above 1 where that of their partners is below. That is the scaling of a
symmetric kernel to given sums (Sinkhorn and Knopp 1967), by the iteration s ← s √(min(a, 1)/(s Ms))
with M of `transport`. What is left to do:

- Between the grid's directions and wavelengths an order may appear or vanish (a Rayleigh anomaly).
  So the albedo is looked at between them too, and s lowered around where it is above 1.
- No scaling exists where a direction's partners all gain and it does not: the light between two
  groups of directions, as a blazed grating has them, is one sum for both. There s ends up between.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..table import DiffractionTable
from .grid import DirectionGrid
from .transport import Orders, Transport

Real = NDArray[np.float64]
Array = NDArray[np.float32]
#: n + ik of the material at wavelengths (n,), nm; None for R = 1.
Index = Callable[[Real], "NDArray[np.complex128] | None"]

#: Directions of the scale, and of the albedo by which it is told whether any is needed.
FINE, COARSE = DirectionGrid(40, 60), DirectionGrid(20, 30)
#: Wavelengths of either; in variants of one wavelength there is one.
FINE_WAVELENGTHS, COARSE_WAVELENGTHS = 12, 4
#: Albedos are scaled to this, half of what may be taken: for what interpolation leaves out.
TARGET = 0.99
SWEEPS = 10
#: s is at most this up to 70°, and from 80° at most 1: there part of a lobe is below the horizon,
#: which would ask for any, and what is above reaches across directions of very different s.
LARGEST = 1.5
#: Parts of a cell, polar and azimuthal, looked at where few orders are strong.
PARTS, FEW_ORDERS = 3, 24
#: How often s is lowered by the root of what is too much, before by all of it.
GENTLE = 2
#: And by how much more than what is too much where it was looked at: peaks lie in between.
PEAKS = 1.3


@dataclass(frozen=True)
class DirectionalTable:
    """A function of wavelength and direction.

    Attributes
    ----------
    wavelengths : (n,) nm, evenly in their logarithm.
    values : (n, polar + 1, azimuthal) on the `grid`.
    """

    wavelengths: Real
    values: Array

    @property
    def grid(self) -> DirectionGrid:
        """Where the values are."""
        return DirectionGrid(self.values.shape[1] - 1, self.values.shape[2])

    def at(self, theta: ArrayLike, phi: ArrayLike, wavelength: float) -> Array:
        """Trilinear, at angles (rad) of any one shape and a wavelength (nm)."""
        place = np.interp(
            np.log(wavelength), np.log(self.wavelengths), np.arange(len(self.wavelengths))
        )
        low = int(min(place, len(self.wavelengths) - 2)) if len(self.wavelengths) > 1 else 0
        high = min(low + 1, len(self.wavelengths) - 1)
        share = np.float32(place - low)
        values = self.values[low] * (1 - share) + self.values[high] * share
        return self.grid.interpolation(theta, phi)(values)


@dataclass(frozen=True)
class Conservation:
    """What a surface reflects, and what is taken of it.

    Attributes
    ----------
    albedo : of the model as it is.
    scale : s, or None where the albedo is at most 1; Kirchhoff's is faded then (`gain.fade`).
    """

    albedo: DirectionalTable
    scale: DirectionalTable | None


def conservation(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    wavelength_range: tuple[float, float],
) -> Conservation:
    """Of a table at one height scale: a second or two where energy is gained.

    Parameters
    ----------
    model : "kirchhoff" or "small_slope".
    index : of the material over that of the medium above it.
    wavelength_range : nm; both ends may be one.
    """
    maps = _Maps(_orders(table, height_scale), model, index)
    low, high = wavelength_range
    for grid, count in ((COARSE, COARSE_WAVELENGTHS), (FINE, FINE_WAVELENGTHS)):
        wavelengths = np.geomspace(low, high, count if high > low else 1)
        transports = maps.at(wavelengths, grid.theta, grid.phi, grid)
        weights = np.ones((grid.polar + 1, grid.azimuthal), np.float32)
        values = np.stack([transport(weights) for transport in transports])
        albedo = DirectionalTable(wavelengths, values)
        if values.max() <= TARGET:
            return Conservation(albedo, None)
    if maps.fades:
        transports = maps.at(wavelengths, grid.theta, grid.phi, grid, faded=True)
    aims = np.clip(values, np.float32(0.0), np.float32(TARGET))  # quadrature may fall below 0
    scale = np.stack([_scaled(*one) for one in zip(transports, aims, strict=True)])
    return Conservation(albedo, maps.lowered(DirectionalTable(wavelengths, scale)))


def albedos(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    found: Conservation,
    theta: Real,
    phi: Real,
    wavelength: float,
) -> tuple[Array, Array]:
    """The albedo as it is and as it is conserved, (t, p) each, at angles (rad) and one wavelength.

    Exact sums at these directions, not the grid's: what a furnace finds. Arguments as in
    `conservation`, which gave `found`.
    """
    maps, at = _Maps(_orders(table, height_scale), model, index), np.array([wavelength])
    grid = FINE if found.scale is None else found.scale.grid
    ones = np.ones((grid.polar + 1, grid.azimuthal), np.float32)
    raw = maps.at(at, theta, phi, grid)[0](ones)
    if found.scale is None:
        return raw, raw
    transport = maps.at(at, theta, phi, grid, maps.fades)[0]
    s = found.scale.at(grid.theta[:, None], grid.phi, wavelength)
    return raw, found.scale.at(theta[:, None], phi, wavelength) * transport(s)


def _orders(table: DiffractionTable, height_scale: float) -> Orders:
    """Those last asked for, kept in the table itself: they go with it."""
    last: dict[float, Orders] = table.__dict__.setdefault("_orders", {})
    if height_scale not in last:
        last.clear()
        last[height_scale] = Orders(table, height_scale)
    return last[height_scale]


def _scaled(transport: Transport, aim: Array) -> Array:
    """s of one wavelength, at the grid's directions alone."""
    s = np.ones_like(aim)
    if aim.max() < TARGET:
        return s
    degrees = np.degrees(FINE.theta[:, None])
    largest = np.interp(degrees, (70.0, 80.0), (LARGEST, 1.0)).astype(np.float32)
    for _ in range(SWEEPS):
        s = s * np.sqrt(aim / np.maximum(s * transport(s), 1e-6))
        s = np.minimum(s, largest)
    return s


@dataclass(frozen=True)
class _Maps:
    """The maps from weights to albedos."""

    orders: Orders
    model: str
    index: Index

    @property
    def fades(self) -> bool:
        return self.model == "kirchhoff"

    def at(
        self, wavelengths: Real, theta: Real, phi: Real, grid: DirectionGrid, faded: bool = False
    ) -> list[Transport]:
        """At several wavelengths (nm), for directions, from weights on a grid."""
        found = self.index(wavelengths)
        indices = [None] * len(wavelengths) if found is None else [complex(n) for n in found]

        def one(wavelength: float, index: complex | None) -> Transport:
            return self.orders.transport(
                theta, phi, float(wavelength), self.model, index, grid, faded
            )

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(one, wavelengths, indices))

    def lowered(self, scale: DirectionalTable) -> DirectionalTable:
        """s lowered around where between its nodes the albedo is above 1."""
        grid, s = scale.grid, scale.values.copy()
        parts = PARTS if len(self.orders.mixture.frequency) <= FEW_ORDERS else 1
        theta, phi = _between(grid, parts)
        middle = np.sqrt(scale.wavelengths[1:] * scale.wavelengths[:-1])
        if not len(middle):
            middle = scale.wavelengths
        transports = self.at(middle, theta, phi, grid, self.fades)
        here = grid.interpolation(theta[:, None], phi)
        for turn in range(GENTLE + 1):
            excess = np.empty((len(middle), *s.shape[1:]), np.float32)
            for n, transport in enumerate(transports):
                mean = 0.5 * (s[n] + s[min(n + 1, len(s) - 1)])
                found = (here(mean) * transport(mean)).reshape(grid.polar, parts, -1, parts)
                excess[n] = _largest_around(np.maximum(found.max(axis=(1, 3)), 1.0))
            if len(s) > 1:
                both = np.maximum(excess[1:], excess[:-1])
                excess = np.concatenate([excess[:1], both, excess[-1:]])
            s /= 1.0 + PEAKS * (excess - 1.0) if turn == GENTLE else np.sqrt(excess)
        return DirectionalTable(scale.wavelengths, s)


def _between(grid: DirectionGrid, parts: int) -> tuple[Real, Real]:
    """Middles of the parts of all cells: polar angles and azimuths."""
    low, high = grid.theta[:-1, None], grid.theta[1:, None]
    theta = low + (high - low) * ((np.arange(parts) + 0.5) / parts)
    count = grid.azimuthal * parts
    phi: Real = (np.arange(count, dtype=float) + 0.5) * (2.0 * np.pi / count)
    return theta.ravel(), phi


def _largest_around(cells: Array) -> Array:
    """From cells (polar, azimuthal) to vertices, each the largest of the cells around it."""
    rows = np.concatenate([cells[:1], np.maximum(cells[1:], cells[:-1]), cells[-1:]])
    rows[0] = rows[0].max()  # all cells of the first row meet at the normal
    return np.maximum(rows, np.roll(rows, 1, axis=1))
