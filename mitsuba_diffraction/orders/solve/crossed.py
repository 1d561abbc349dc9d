"""Crossed gratings by coupled waves in two dimensions, in light from above, in air.

Heights are cut into slices of pixels, whose ε is expanded along x and y as Li has it for products
of discontinuous functions (Li 1997, JOSA A 14, 2758). The waves of a stack of layers are those of
`coupled`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Complex, Real
from ...errors import DiffractionError, counted, warn
from ..response import orders_between
from .coupled import Inner, Modes, modes, scattered
from .grating_index import TabulatedIndex
from .profiles import UnitCell
from .stations import CrossedStation

#: k above which a material absorbs, and staircases of metal converge slowly.
_ABSORBING = 1e-3
#: Slices for each harmonic on a side.
_SLICES = 3
#: Longest period, and highest heights, over the shortest wavelength: more orders take hours, and
#: slices of higher heights are thicker than fringes. Heights of 10 nm given as µm are higher.
_LONGEST, _HIGHEST = 4.0, 20.0
#: θ and φ of the directions that a table of all light has, degrees.
THETA, PHI = np.linspace(0.0, 88.0, 12), np.arange(0.0, 360.0, 10.0)


class CrossedWaves:
    """Coupled waves for one period of heights; a `solve.stations.Solver`.

    Parameters
    ----------
    cell : heights.
    harmonics : spatial frequencies on either side of the middle one, along the longer period.
    """

    def __init__(self, cell: UnitCell, harmonics: int) -> None:
        self.cell = cell
        self._last = [math.ceil(harmonics * period / cell.period) for period in cell.periods]
        count = _SLICES * harmonics if cell.depth else 0
        # rounded, so that mirror images have the same slices
        tops = np.round((cell.heights - cell.heights.min()) / max(cell.depth, 1e-12) * count, 9)
        #: Slices from the material upwards: filled shares of the pixels, (rows, columns).
        self._slices = [np.clip(tops - below, 0.0, 1.0) for below in range(count)]

    @property
    def name(self) -> str:
        """Name and settings."""
        along_x, along_y = (2 * last + 1 for last in self._last)
        return (
            f"coupled waves, {along_x} x {along_y} harmonics, {counted(len(self._slices), 'slice')}"
        )

    def amplitudes(self, station: CrossedStation) -> Complex:
        """Return the amplitudes (1, orders, 2, orders, 2) between all orders that propagate.

        In the order of `CrossedStation.orders`; see `stations.Solver`.

        Raises a DiffractionError if an order propagates that the harmonics do not have.
        """
        every = orders_between([-last for last in self._last], self._last)
        places = {tuple(order): n for n, order in enumerate(every.tolist())}
        channels = [places.get(tuple(order), -1) for order in station.orders.tolist()]
        if min(channels) < 0:
            raise DiffractionError(f"{self.cell.name}: more orders propagate; raise the resolution")
        x, y = station.tangential(every)
        epsilon = station.index**2
        thickness = self.cell.depth / max(len(self._slices), 1) / station.wavelength
        layers = ((thickness, each) for each in self._each_slice(x, y, epsilon))
        top = self.cell.depth / station.wavelength
        inner = Inner(np.arange(0), 1.0, 0.0)
        return scattered((x, y), layers, epsilon, np.array(channels), top, inner)[None]

    def _each_slice(self, x: Real, y: Real, epsilon: complex) -> Iterator[Modes]:
        """Yield the modes of each slice; equal neighbours, as in a pillar, share one solution."""
        for n, filled in enumerate(self._slices):
            if n == 0 or not np.array_equal(filled, self._slices[n - 1]):
                found = self._modes(x, y, filled, epsilon)
            yield found

    def _modes(self, x: Real, y: Real, filled: Real, epsilon: complex) -> Modes:
        """Return the modes of a slice: ε is the mean for Ex and Ey, the harmonic mean for Ez."""
        pixels = 1.0 + filled * (epsilon - 1.0)
        along = _matrix(1.0 / (1.0 - filled + filled / epsilon), self._last, lambda rows: rows)
        # across walls Dx and Dy are continuous, and the matrices those of 1/ε, inverted
        across_x = _matrix(1.0 / pixels, self._last, np.linalg.inv)
        across_y = _matrix(1.0 / pixels.T, self._last[::-1], np.linalg.inv)
        n_x, n_y = (2 * last + 1 for last in self._last)
        turned = across_y.reshape(n_x, n_y, n_x, n_y).transpose(1, 0, 3, 2)
        return modes(x, y, across_x, turned.reshape(n_x * n_y, -1), along)


def _matrix(pixels: NDArray[Any], last: list[int], of_rows: Any) -> Complex:
    """Return the matrix of a product with pixels (rows, columns): Toeplitz along x, then along y.

    last : largest harmonics along x and along y, x innermost; of_rows : changes the matrices
        along x of all rows, (rows, n, n).
    """
    n_x, n_y = (2 * largest + 1 for largest in last)
    coefficients = pixels @ _transform(pixels.shape[1], 2 * last[0])
    place = np.arange(n_x)[:, None] - np.arange(n_x) + 2 * last[0]
    # lines of equal pixels are many
    different, number = np.unique(coefficients, axis=0, return_inverse=True)
    rows = of_rows(different[:, place])[number.ravel()]
    blocks = np.tensordot(_transform(len(pixels), 2 * last[1]).T, rows, 1)
    place = np.arange(n_y)[:, None] - np.arange(n_y) + 2 * last[1]
    return np.asarray(blocks[place].transpose(0, 2, 1, 3).reshape(n_x * n_y, -1))


def _transform(pixels: int, last: int) -> Complex:
    """Return the integrals of exp(−2πimx) over each pixel of a period, (pixels, 2 last + 1)."""
    m = np.arange(-last, last + 1)
    middle = np.arange(pixels)[:, None] / pixels
    return np.asarray(np.exp(-2j * np.pi * m * middle) * np.sinc(m / pixels) / pixels)


def check_cell(cell: UnitCell, material: TabulatedIndex, wavelengths: tuple[float, float]) -> None:
    """Refuse gratings that this solver cannot solve, and warn of metals.

    Raises a DiffractionError for perfect conductors, and too long periods or high heights.
    """
    index = material.index(wavelengths)
    if index is None:
        raise DiffractionError("crossed gratings of perfect conductors are not solved; give Al")
    for what, length, times in (
        ("periods", cell.period, _LONGEST), ("heights, lowest to highest,", cell.depth, _HIGHEST),
    ):  # fmt: skip
        most = 1e-3 * times * wavelengths[0]
        if length > most:
            raise DiffractionError(
                f"crossed grating: {what} must be at most {most:.3g} µm, {times:g} times the "
                f"shortest wavelength, {wavelengths[0]:g} nm, and are {length:.3g} µm; are all "
                "lengths in µm?"
            )
    if (np.abs(index.imag) > _ABSORBING).any():
        warn(
            f"{material.name} absorbs: coupled waves converge slowly on slopes of metal, some 4 % "
            "of the light on crossed gratings"
        )


class Folded(NamedTuple):
    """Azimuths of light mirrored in a grating's mirror planes, and how its orders are mirrored.

    Attributes
    ----------
    phi : (n,) degrees.
    steps : (n, 2) along the orders, ±1.
    turns : (n, 2) phase of the first order, over 2π: mirrors need not pass through the origin.
    """

    phi: Real
    steps: NDArray[np.int64]
    turns: Real


def folded(cell: UnitCell | None, phi: ArrayLike) -> Folded:
    """Return azimuths (n,), degrees, of which mirror planes of the heights make all.

    cell : None for grooves, whose azimuths stay as they are.
    """
    azimuth = np.asarray(phi, np.float64)
    steps = np.ones((len(azimuth), 2), np.int64)
    if cell is None:
        return Folded(azimuth, steps, np.zeros(steps.shape))
    azimuth = azimuth % 360.0
    along_x, along_y = _mirrors(cell.heights)
    if along_y is not None:
        steps[:, 1] = np.where(beyond := azimuth > 180.0, -1, 1)
        azimuth = np.where(beyond, 360.0 - azimuth, azimuth)
    if along_x is not None:
        steps[:, 0] = np.where(beyond := (azimuth > 90.0) & (azimuth < 270.0), -1, 1)
        azimuth = np.where(beyond, (180.0 - azimuth) % 360.0, azimuth)
    turns = np.where(steps < 0, [along_x or 0.0, along_y or 0.0], 0.0)
    return Folded(np.round(azimuth, 9), steps, turns)


def _mirrors(heights: Real) -> tuple[float | None, float | None]:
    """Return a, along x and along y, where heights at x are those at a − x; None without mirror.

    a is a part of the period, from the middle of the first pixel.
    """
    found: list[float | None] = []
    for axis in (1, 0):
        image = np.flip(heights, axis)
        count = image.shape[axis]
        shifted = (np.roll(image, n, axis) for n in range(count))
        alike = (np.allclose(heights, each, atol=1e-9) for each in shifted)
        found.append(next(((n - 1) / count for n, same in enumerate(alike) if same), None))
    return found[0], found[1]
