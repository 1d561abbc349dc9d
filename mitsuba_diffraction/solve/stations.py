"""Stations: the sets of directions between which a grating scatters light at one wavelength.

Direction cosines are x along the grating vector and y along the grooves, of the direction in which
light travels. With c = √(1 − y²), s = x/c, g = λ/(c·d) and K = 2/g, order m leaves at s + m g. The
position p = (1 − s)/g lies in [0, K], and order m leaves at p − m. Let k = ⌊K⌋, r = K − k and
f = p − ⌊p⌋: directions with f < r (kind A) have k + 1 channels ⌊p⌋ = 0…k, others (kind B) have k.
Efficiencies between channels are smooth in t = f/r (A) or t = (f − r)/(1 − r) (B), in r and in λ;
at the ends of t and r, where an order becomes propagating, they have square roots, which
t = sin²(πτ/2) and r = sin²(πρ/2) remove.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Station:
    """One set of channels at some wavelengths.

    Attributes
    ----------
    extent : K, the number of orders that fit between grazing directions.
    fraction : f of all channels, in (0, 1).
    wavelengths : (n,) in the medium above, in the unit of the period.
    indices : (n,) n + ik of the material over that of the medium above; None for a perfect
        conductor.
    along : (n,) direction cosine y along the grooves.
    """

    extent: float
    fraction: float
    wavelengths: Real
    indices: NDArray[np.complex128] | None
    along: Real

    @property
    def sines(self) -> Real:
        """s of each channel, (channels,), descending."""
        channels = np.arange(int(np.floor(self.extent - self.fraction)) + 1)
        return np.asarray(1.0 - 2.0 * (channels + self.fraction) / self.extent)


def station_of(
    k: int, kind: str, t: float, r: float, wavelengths: Real, indices: NDArray[np.complex128] | None,
    period: float,
) -> Station:
    """Return the station at (t, r) of a band and kind ("a" or "b"); lengths in one unit."""
    extent = k + r
    fraction = t * r if kind == "a" else r + t * (1.0 - r)
    cosine = extent * wavelengths / (2.0 * period)
    along = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    return Station(extent, fraction, wavelengths, indices, along)
