"""Stations: sets of directions between which a grating scatters light, solved together.

All channels of one (band, kind, τ, ρ) of `cells` have the same Bloch wave, so they
share the expensive part of a solver. A station has several wavelengths w at the same s and K.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Complex, Real
from .. import cells
from ..response import orders_between
from .films import Structure
from .grating_index import TabulatedIndex
from .profiles import Profile, UnitCell

Number = TypeVar("Number", np.float64, np.complex128)

#: Least c = √(1 − y²), and least |cosine| of any order across the grooves: 0.006° from grazing.
#: Stations beyond have the efficiencies of this cosine.
LEAST_COSINE = 1e-4
#: Least normal part of the wave vector of a wave that counts as propagating, over its length; below
#: that of all channels outside.
LEAST_NORMAL = 5e-5


@dataclass(frozen=True, eq=False)
class Grating:
    """Periodic surface for which a table is solved.

    Attributes
    ----------
    profile : one period of the grooves, or of a crossed grating's heights.
    material : below the profile.
    superstrate : real index of the clear medium above.
    wavelengths : shortest and longest of the table, in vacuum, nm.
    thin : whether the material is a sheet with a flat lower side (`sheet`).
    structure : films on the profile, and what lies beneath it.
    block : whether the medium above is a block, the material the rarer one that surrounds it, and
        light of both is solved (`blocks`).
    """

    profile: Profile | UnitCell
    material: TabulatedIndex
    superstrate: float
    wavelengths: tuple[float, float]
    thin: bool = False
    structure: Structure = field(default_factory=Structure)
    block: bool = False

    @property
    def optical_period(self) -> float:
        """Period times the superstrate's index, µm."""
        return self.superstrate * self.profile.period

    @property
    def sides(self) -> int:
        """Number of sides with light: 2 of a thin sheet or a block, else 1."""
        return 2 if self.thin or self.block else 1

    @property
    def media(self) -> tuple[float, bool, float | None]:
        """Return `superstrate`, `thin` and `block` of the grating's table."""
        return (1.0, False, self.superstrate) if self.block else (self.superstrate, self.thin, None)

    @property
    def cell(self) -> UnitCell | None:
        """Heights of a crossed grating; None of grooves."""
        return self.profile if isinstance(self.profile, UnitCell) else None

    @property
    def line(self) -> Profile:
        """Profile of the grooves."""
        assert isinstance(self.profile, Profile)
        return self.profile

    @property
    def periods(self) -> tuple[float, float]:
        """Periods along x and y, µm; the second one is infinite for grooves."""
        return (self.profile.period, math.inf) if self.cell is None else self.cell.periods

    @property
    def is_perfect(self) -> bool:
        """Whether the material is a perfect conductor, whose efficiencies do not depend on w."""
        return self.material.values is None

    @property
    def material_text(self) -> str:
        """Materials from the top, for people."""
        slices = self.structure.slices
        films = (
            f"{film.material.name} {film.thickness:g} µm" for film in reversed(self.structure.films)
        )
        lower = [
            f"{' and '.join(dict.fromkeys(part.material.name for part in layer.parts)) or 'gap'} "
            f"{layer.thickness:g} µm"
            for layer in reversed(slices)
        ]
        if len(lower) > 4:
            lower = [*lower[:2], f"{len(lower) - 3} layers", lower[-1]]
        own = [self.material.name] if self.profile.depth or not slices else []
        lowest = self.structure.substrate or (self.material if slices else None)
        return " on ".join([*films, *own, *lower, *([lowest.name] if lowest else [])])

    def station(
        self,
        band: int,
        kind: int,
        tau: float,
        rho: float,
        w: ArrayLike,
        least_cosine: float = LEAST_COSINE,
    ) -> Station:
        """Return the station of a band and kind at τ, ρ and several w, (n,).

        least_cosine : across the grooves, of any order.
        """
        r, t = float(cells.sine_squared(rho)), float(cells.sine_squared(tau))
        smallest = least_cosine * 2e3 * self.optical_period / self.wavelengths[0] - band
        # an order at a distance δ from the end of p has the squared cosine 4δ/K
        margin = 0.25 * least_cosine**2 * max(band + r, 1e-3)
        # only the kind's own width has to hold two margins: K may be a whole number, as at λ = 2d/N
        ends = (2.0 * margin, 1.0) if kind == cells.A else (0.0, 1.0 - 2.0 * margin)
        r = float(np.clip(max(r, smallest), *ends))
        begin, end = (0.0, r) if kind == cells.A else (r, 1.0)
        fraction = float(np.clip(begin + t * (end - begin), begin + margin, end - margin))
        big_k = band + r
        lam = np.atleast_1d(cells.wavelength_of(big_k, w, self.wavelengths, self.optical_period))
        longest = 2e3 * self.optical_period / big_k
        cosine = np.minimum(lam / longest, np.sqrt(1.0 - cells.LEAST_ALONG**2))
        lam = cosine * longest
        index = self.material.index(lam)
        return Station(
            big_k,
            fraction,
            band + 1 - kind,
            lam / (1e3 * self.superstrate),
            None if index is None else index / self.superstrate,
            np.sqrt(1.0 - cosine**2),
            self.thin or self.block,
            tuple(
                layer / self.superstrate
                for material in self.structure.materials
                if (layer := material.index(lam)) is not None  # always: `films.structure_of`
            ),
        )

    def crossed_station(self, x: float, y: float, wavelength: float) -> CrossedStation:
        """Return the station of light of a crossed grating; wavelength : nm."""
        index = self.material.index(wavelength)
        assert index is not None  # `crossed.check_cell`
        return CrossedStation(x, y, 1e-3 * wavelength, complex(index), self.periods)


@dataclass(frozen=True, eq=False)
class CrossedStation:
    """Light of a crossed grating, with which all its orders are solved.

    Attributes
    ----------
    x, y : direction cosines of the mirror direction of the incident light.
    wavelength : µm.
    index : n + ik of the material.
    periods : along x and y, µm.
    """

    x: float
    y: float
    wavelength: float
    index: complex
    periods: tuple[float, float]

    def tangential(self, orders: NDArray[np.int64]) -> tuple[Real, Real]:
        """Return x and y of orders (n, 2), (n,) each."""
        shifts = (self.wavelength * m / d for m, d in zip(orders.T, self.periods, strict=True))
        x, y = (part + shift for part, shift in zip((self.x, self.y), shifts, strict=True))
        return x, y

    @property
    def orders(self) -> NDArray[np.int64]:
        """Orders (n, 2) that propagate."""
        most = [int(2.0 * period / self.wavelength) + 1 for period in self.periods]
        every = orders_between([-m for m in most], most)
        x, y = self.tangential(every)
        return every[x * x + y * y < 1.0 - LEAST_NORMAL**2]


@dataclass(frozen=True, eq=False)
class Station:
    """Set of channels at some wavelengths.

    Attributes
    ----------
    extent : K, the orders that fit between both grazing directions.
    fraction : f of all channels, in (0, 1).
    channels : number of propagating channels.
    wavelengths : (n,) in the medium above, µm.
    indices : (n,) n + ik of the material relative to the medium above; None for a perfect
        conductor, of which only the first wavelength is solved.
    along : (n,) direction cosine y along the grooves.
    thin : whether light comes from within the material as well.
    media : indices (n,) of the materials of the structure, relative to the medium above.
    """

    extent: float
    fraction: float
    channels: int
    wavelengths: Real
    indices: NDArray[np.complex128] | None
    along: Real
    thin: bool = False
    media: tuple[Complex, ...] = ()

    @property
    def sines(self) -> Real:
        """Return s of each channel, (channels,), descending."""
        return self.sines_of(np.arange(self.channels))

    @property
    def inside(self) -> NDArray[np.int64]:
        """Numbers of the channels in which light of any wavelength propagates within a sheet."""
        if not self.thin or self.indices is None:
            return np.arange(0)
        square = float(((self.indices.real**2 - self.along**2) / (1 - self.along**2)).max())
        if square <= 0.0:  # all light is guided within a block
            return np.arange(0)
        middle, half = 0.5 * self.extent - self.fraction, 0.5 * self.extent * np.sqrt(square)
        return np.arange(int(np.ceil(middle - half)), int(np.floor(middle + half)) + 1)

    def sines_of(self, channels: NDArray[np.int64]) -> Real:
        """Return s of channels by number, also of those that propagate within a sheet alone."""
        return np.asarray(1.0 - 2.0 * (channels + self.fraction) / self.extent)


class Solver(Protocol):
    """Rigorous solver of one profile; the interface of all adapters."""

    @property
    def name(self) -> str:
        """Name, version and settings, for the header of tables."""

    def amplitudes(self, station: Any) -> Complex:
        """Return the amplitudes between all ports of a `Station`, whose |·|² are efficiencies.

        Ports are the channels above, then, of a thin station, its channels `inside` the material.
        Those that do not propagate at a wavelength have zeros.

        Light along d is a sum of E along e and E along d × e, with e the direction of the grooves
        (y) made perpendicular to d: its E, or its B, lies along the grooves, as far as it can. In
        the plane across the grooves they are s and p. Time is exp(−iωt), and phases are those at
        z = 0 of the profile.

        Returns
        -------
        (wavelengths, ports in, 2, ports out, 2) : outgoing over incident field, of waves that
            carry unit power through the surface. A perfect conductor has one wavelength, for all.
        """


def reversed_light(values: NDArray[Number], sides: int = 1) -> NDArray[Number]:
    """Return the amplitudes, or efficiencies, of the reversed light, at 1 − t, by reciprocity.

    sides : 2 of efficiencies of a sheet, with the ports of `cells`.

    The amplitude from channel j and polarisation a to q and b is the amplitude from last − q and b
    to last − j and a (Petit 1980, "Electromagnetic theory of gratings", section 1.4).
    """
    ports = cells.reversed_ports(values.shape[1], sides)
    return values[:, ports][:, :, :, ports].transpose(0, 3, 4, 1, 2)


def on_both_sides(amplitudes: Complex, station: Station) -> Complex:
    """Return amplitudes between as many ports below as above, 0 where no channel propagates."""
    n = station.channels
    ports = np.concatenate([np.arange(n), n + station.inside])
    shape = (len(amplitudes), 2 * n, 2, 2 * n, 2)
    result = np.zeros(shape, complex)
    result[:, ports[:, None], :, ports] = amplitudes.transpose(1, 3, 0, 2, 4)
    return result
