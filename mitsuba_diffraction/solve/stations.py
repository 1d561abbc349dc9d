"""Stations: sets of directions between which a grating scatters light, solved together.

All channels of one (band, kind, τ, ρ) of `tables.orders.cells` have the same Bloch wave, so they
share what is expensive in a solver. A station has several wavelengths w at the same s and K.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..tables.orders import cells
from .materials import Material
from .profiles import Profile

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Number = TypeVar("Number", np.float64, np.complex128)

#: Least c = √(1 − y²), and least |cosine| of any order across the grooves: 1.7° from grazing.
#: There solvers lose digits as 1/cosine, and diffuse light has 1e-3 of its power. Stations beyond
#: have the efficiencies of this cosine.
LEAST_COSINE = 0.03


@dataclass(frozen=True, eq=False)
class Grating:
    """Periodic surface for which a table is solved.

    Attributes
    ----------
    profile : one period of the grooves.
    material : below the profile.
    superstrate : real index of the clear medium above.
    wavelengths : shortest and longest of the table, in vacuum, nm.
    """

    profile: Profile
    material: Material
    superstrate: float
    wavelengths: tuple[float, float]

    @property
    def optical_period(self) -> float:
        """Period times the superstrate's index, µm."""
        return self.superstrate * self.profile.period

    @property
    def is_perfect(self) -> bool:
        """Whether the material is a perfect conductor, whose efficiencies do not depend on w."""
        return self.material.values is None

    def station(self, band: int, kind: int, tau: float, rho: float, w: ArrayLike) -> Station:
        """Return the station of a band and kind at τ, ρ and several w, (n,)."""
        r, t = float(cells.sine_squared(rho)), float(cells.sine_squared(tau))
        smallest = LEAST_COSINE * 2e3 * self.optical_period / self.wavelengths[0] - band
        # an order at a distance δ from the end of p has the squared cosine 4δ/K
        margin = 0.25 * LEAST_COSINE**2 * (band + r)
        r = float(np.clip(max(r, smallest), 2.0 * margin, 1.0 - 2.0 * margin))
        begin, end = (0.0, r) if kind == cells.A else (r, 1.0)
        fraction = float(np.clip(begin + t * (end - begin), begin + margin, end - margin))
        big_k = band + r
        lam = np.atleast_1d(cells.wavelength_of(big_k, w, self.wavelengths, self.optical_period))
        cosine = big_k * lam / (2e3 * self.optical_period)
        index = self.material.index(lam)
        return Station(
            big_k,
            fraction,
            band + 1 - kind,
            lam / (1e3 * self.superstrate),
            None if index is None else index / self.superstrate,
            np.sqrt(np.maximum(1.0 - cosine**2, 0.0)),
        )


@dataclass(frozen=True, eq=False)
class Station:
    """Set of channels at some wavelengths.

    Attributes
    ----------
    extent : K, the orders that fit between both grazing directions.
    fraction : f of all channels, in (0, 1).
    channels : number of propagating channels.
    wavelengths : (n,) in the medium above, µm.
    indices : (n,) n + ik of the material over that of the medium above; None for a perfect
        conductor, of which only the first wavelength is solved.
    along : (n,) direction cosine y along the grooves.
    """

    extent: float
    fraction: float
    channels: int
    wavelengths: Real
    indices: NDArray[np.complex128] | None
    along: Real

    @property
    def sines(self) -> Real:
        """Return s of each channel, (channels,), descending."""
        return np.asarray(1.0 - 2.0 * (np.arange(self.channels) + self.fraction) / self.extent)


class Solver(Protocol):
    """Rigorous solver of one profile; the interface of all adapters."""

    @property
    def name(self) -> str:
        """Name, version and settings, for the header of tables."""

    def amplitudes(self, station: Station) -> Complex:
        """Return the amplitudes between all channels, whose |·|² are efficiencies.

        Light along d is a sum of E along e and E along d × e, with e the direction of the grooves
        (y) made perpendicular to d: its E, or its B, lies along the grooves, as far as it can. In
        the plane across the grooves they are s and p. Time is exp(−iωt), and phases are those at
        z = 0 of the profile.

        Returns
        -------
        (wavelengths, channels in, 2, channels out, 2) : outgoing over incident field, of waves that
            carry unit power through the surface. A perfect conductor has one wavelength, for all.
        """


def reversed_light(values: NDArray[Number]) -> NDArray[Number]:
    """Return the amplitudes, or efficiencies, of the reversed light, at 1 − t, by reciprocity.

    The amplitude from channel j and polarisation a to q and b is the amplitude from last − q and b
    to last − j and a (Petit 1980, "Electromagnetic theory of gratings", section 1.4).
    """
    return np.flip(values, (1, 3)).transpose(0, 3, 4, 1, 2)
