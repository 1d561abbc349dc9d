"""A thin film over a material, coherent with it (Dr.Jit): see `optics.fresnel.Filmed`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.interpolate import CubicSpline

from ..optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from ..optics.geometry import wavenumber
from .changing import Bounded
from .fresnel import Filmed, amplitudes, squared
from .reflectance import Conductor, Dielectric
from .roles import Callback, Colour, Float, Interaction, Mask, Number

#: Path there and back, nm, over which light interferes: λ²/Δλ at 550 nm of a band of 25 nm.
COHERENCE = 12e3
#: Power that comes back of light that would see the material alone, below which nobody sees it.
LEAST_THROUGH = 1e-6

# Ends of what RGB variants sum, nm, and nodes between them a fringe, evenly in 1/λ
_ENDS, _PER_FRINGE, _LEAST_NODES = (390.0, 710.0), 4, 6


@dataclass(frozen=True)
class Channels:
    """How RGB variants sum a film's colours: channels are `weights` (3, n) times those at nodes.

    Attributes
    ----------
    wavelengths : (n,) nm.
    """

    wavelengths: list[float]
    weights: list[list[float]]

    @classmethod
    def of(cls, path: float) -> Channels:
        """For fringes of a path there and back (nm): a cubic spline under the sensitivities."""
        first, last = (1.0 / end for end in _ENDS)
        count = _LEAST_NODES + math.ceil(_PER_FRINGE * path * (first - last))
        nodes = np.linspace(last, first, count)
        dense = np.arange(*_ENDS, 1.0)
        rows = linear_srgb(response(dense)).T @ CubicSpline(nodes, np.eye(count))(1.0 / dense)
        return cls((1.0 / nodes).tolist(), (rows / rows.sum(axis=1, keepdims=True)).tolist())

    def sums(self, values: list[Float]) -> list[Float]:
        """The channels' of values at the nodes; none below 0, as of a colour beyond the gamut."""
        return [
            dr.maximum(sum(w * v for w, v in zip(row, values, strict=True)), 0.0)
            for row in self.weights
        ]


class UnderFilm:
    """A material under a film; wherever a material is asked for its reflectance or its indices.

    Parameters
    ----------
    material : the material itself.
    film : the real part of the film's index, over that of the medium above it.
    k : its imaginary part.
    thickness : nm.
    wavelength : nm, of mono variants.
    """

    def __init__(
        self,
        material: Dielectric | Conductor,
        film: Dielectric,
        k: float,
        thickness: float,
        wavelength: float,
    ) -> None:
        self.material, self.film, self._fixed = material, film, mi.Float(wavelength)
        dr.make_opaque(self._fixed)
        self._k = Bounded("film_k", k, 0.0, math.inf, _refusal)
        self._thickness = Bounded("film_thickness", thickness, 0.0, COHERENCE, _refusal)
        self.k, self.thickness = self._k.value, self._thickness.value
        self.channels: Channels | None = None
        self._path = -1.0
        self.settle()

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """R of the flat film for the cosine of the angle of incidence, unpolarised."""
        square = dr.fma(-cos_theta, cos_theta, 1.0)
        pairs = [amplitudes(cos_theta, square, index) for index in self.indices(si, active)]
        powers = [0.5 * (squared(r_s) + squared(r_p)) for r_s, r_p in pairs]
        return mi.UnpolarizedSpectrum(self.summed(powers))

    def indices(self, si: Interaction, active: Mask) -> list[Filmed]:
        """Of each channel, or in RGB variants of each of the wavelengths that are summed."""
        found = [_complex(n) for n in self.material.indices(si, active)]
        waves = self._wavelengths(si)
        if self.channels is not None:
            found = _between(found, self.channels.wavelengths)
        elif len(found) == 1:
            found *= len(waves)
        film, depth = mi.Complex2f(self.film.eta, self.k), self.thickness * (2.0 * dr.pi)
        return [Filmed(n, film, depth * dr.rcp(w)) for n, w in zip(found, waves, strict=True)]

    def summed(self, values: list[Float]) -> list[Float]:
        """The channels' values of those of `indices`."""
        return values if self.channels is None else self.channels.sums(values)

    def wavenumbers(self, given: list[Float]) -> list[Float]:
        """rad/µm of `indices`; given : of the channels."""
        if self.channels is None:
            return given
        return [mi.Float(k) for k in wavenumber(self.channels.wavelengths).tolist()]

    def traverse(self, callback: Callback) -> None:
        """Expose what the material has, and the film's `film_eta`, `film_k`, `film_thickness`."""
        for one in (self.material, self.film, self._k, self._thickness):
            one.traverse(callback)

    def settle(self) -> str | None:
        """See `Bounded.settle`."""
        changing = self.material, self.film, self._k, self._thickness
        refused = [line for line in [one.settle() for one in changing] if line]
        path = 2.0 * plain(self.film.eta) * plain(self.thickness)
        # Fewer fringes need no other kernels
        if mi.is_rgb and path > self._path:
            self._path, self.channels = path, Channels.of(path)
        return "; ".join(refused) or None

    def numbers(self) -> tuple[complex, float]:
        """The film's index and its thickness, nm."""
        return complex(plain(self.film.eta), plain(self.k)), plain(self.thickness)

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if self.channels is not None:
            return [mi.Float(wavelength) for wavelength in self.channels.wavelengths]
        return list(si.wavelengths) if mi.is_spectral else [self._fixed]

    def __str__(self) -> str:
        index, thickness = self.numbers()
        return f"{self.material} under film[eta = {index:.5g}, {thickness:.5g} nm]"


def _refusal(value: float) -> str:
    return (
        f"film_k or film_thickness={value:g} must be at least 0, and the thickness at most "
        f"{COHERENCE:g} nm"
    )


def _complex(index: Number) -> Number:
    return index if dr.is_complex_v(index) else mi.Complex2f(index, 0.0)


def _between(found: list[Number], wavelengths: list[float]) -> list[Number]:
    """An index by red, green and blue at other wavelengths: linear, level beyond the ends."""
    if len(found) == 1:
        return found * len(wavelengths)
    shares = [np.interp(wavelengths, RGB_WAVELENGTHS[::-1], row) for row in np.eye(3)]
    rows = np.stack(shares[::-1], axis=1).tolist()
    return [sum(n * w for n, w in zip(found, row, strict=True)) for row in rows]


def plain(number: Float) -> float:
    """A number of all lanes."""
    return float(dr.slice(dr.detach(number)))
