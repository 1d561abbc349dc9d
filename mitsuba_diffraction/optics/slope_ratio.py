"""r, which tells hills from pits: spectra of squared slopes over those of the phase (NumPy).

Of a periodic surface, with a and D_l spectra (exp(−iq·r)) of exp(−iκh) and (∂_l h)² exp(−iκh), l
along an order's q and t across it,

    r_l = a* D_l / |a|²,   r_t likewise,

times `second_order`'s gate: see there. A power spectrum knows |a|² alone. Of many orders r is
Σ a* D / Σ|a|² over a cell of q. Order 0 has none: the first order's is its power.

Slopes are those of the surface filtered by 1/(1 + (q/23)²), q in rad/µm: what is finer than light
does not diffract it twice into waves that travel. Where little is left of their variance, as of
vertical walls, squares of slopes say nothing, hence the gate ρ²/(ρ² + 0.01), ρ what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from .second_order import Complex, Real

#: Where slopes are filtered, rad/µm: `second_order.CUTOFF` at 550 nm, the same at all wavelengths.
CUTOFF = 23.0
#: ρ of a gate that is half open.
_HALF = 0.1


@dataclass(frozen=True)
class Slopes:
    """Products of the filtered slopes, (3, ny, nx): xx, xy, yy; and the gate, 0 to 1."""

    products: Real
    gate: float

    @classmethod
    def of(
        cls, heights: ArrayLike, pixel_size: tuple[float, float], weight: Real | float = 1.0
    ) -> Slopes:
        """Those of heights (ny, nx) in µm; weight : of points, in the variances."""
        surface = np.asarray(heights, np.float64)
        qx, qy = (_frequencies(n, d) for n, d in zip(surface.shape[::-1], pixel_size, strict=True))
        squares = qx**2 + qy[:, None] ** 2
        spectrum = np.fft.rfft2(surface)
        half = spectrum.shape[1]
        kept = 1.0 / (1.0 + squares[:, :half] / CUTOFF**2)
        waves = 1j * qx[:half], 1j * qy[:, None]
        raw = [np.fft.irfft2(wave * spectrum, s=surface.shape) for wave in waves]
        x, y = (np.fft.irfft2(wave * kept * spectrum, s=surface.shape) for wave in waves)
        every = float(np.mean((raw[0] ** 2 + raw[1] ** 2) * weight))
        left = float(np.mean((x**2 + y**2) * weight)) / every if every > 0.0 else 1.0
        return cls(np.stack([x * x, x * y, y * y]), left**2 / (left**2 + _HALF**2))


def _frequencies(count: int, pixel: float) -> Real:
    """rad/µm of a transform; Nyquist's, whose slope is 0 at the points, as 0."""
    found = np.asarray(2.0 * np.pi * np.fft.fftfreq(count, pixel), np.float64)
    if count % 2 == 0:
        found[count // 2] = 0.0
    return found


def along(q: Real, spectra: Complex) -> Complex:
    """D_l, D_t (..., 2) of spectra (..., 3) of the products; q (..., 2), not 0."""
    x, y = np.moveaxis(q, -1, 0) / np.hypot(q[..., 0], q[..., 1])
    xx, xy, yy = np.moveaxis(spectra, -1, 0)
    length = x * x * xx + 2.0 * x * y * xy + y * y * yy
    return np.stack([length, xx + yy - length], axis=-1)


@dataclass(frozen=True, eq=False)
class SlopeRatios:
    """r of a surface, times its gate, on a grid of q and κ; linear in between.

    Attributes
    ----------
    cell : (dqx, dqy), rad/µm.
    orders : whether a cell is one order, along x and y, and q is rounded to it.
    kappa : first and last κ, rad/µm, evenly between; beyond them r is that of the nearest.
    values : (n, 2, ny, nx) complex, l and t; q = 0 is in the middle.
    """

    cell: tuple[float, float]
    orders: tuple[bool, bool]
    kappa: tuple[float, float]
    values: NDArray[np.complexfloating]

    @property
    def middle(self) -> tuple[int, int]:
        """Index of q = 0, along x and y."""
        _, _, ny, nx = self.values.shape
        return nx // 2, ny // 2

    def at(self, q: ArrayLike, kappa: ArrayLike) -> Complex:
        """r_l, r_t (..., 2) at q (..., 2) and κ (...), both in rad/µm."""
        places, count = np.asarray(q, np.float64) / self.cell + self.middle, len(self.values)
        places = np.where(self.orders, np.round(places), places)
        low, high = self.kappa
        depth = (np.asarray(kappa, np.float64) - low) / (high - low) * (count - 1)
        each = np.stack(np.broadcast_arrays(depth, places[..., 1], places[..., 0]))
        found = [
            map_coordinates(one, each.reshape(3, -1), order=1, mode="nearest")
            for one in (self.values[:, 0], self.values[:, 1])
        ]
        return np.stack(found, axis=-1).reshape(*each.shape[1:], 2).astype(complex)
