"""Layers over the structure: a flat clear coat (`optics.coat`), and a thin film (Dr.Jit).

A film is coherent with the material, see `optics.fresnel.Filmed`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
import scipy
from numpy.typing import NDArray

from ..optics.arithmetic import is_complex
from ..optics.coat import coated_reflectance, cosine_within
from ..optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from .arithmetic import plain
from .description import Feature
from .materials import INDEX_PARTS, Dielectric, Material
from .parameter_changes import Bounded
from .types import Colour, Float, Interaction, Mask, Number


class UnderCoat(Material):
    """Flat faces of a coat and of the material beneath it."""

    def __init__(self, material: Material, coat: Dielectric) -> None:
        self.material: Material = material
        self.coat = coat
        self.changeable = (*material.changeable, *coat.changeable)

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """Reflectance of coat and material together, for the cosine of the angle outside."""
        face = self.coat.reflectance(cos_theta, si, active)
        inside = cosine_within(cos_theta, self.coat.eta)
        return coated_reflectance(face, self.material.reflectance(inside, si, active))

    def derive(self) -> None:
        """Derive what depends on the indices of material and coat."""
        self.material.derive()
        self.coat.derive()

    def __str__(self) -> str:
        return f"{self.material} under coat[eta = {plain(self.coat.eta):.5g}]"


#: Path there and back, nm, over which light interferes: λ²/Δλ at 550 nm of a band of 25 nm.
COHERENCE = 12e3
#: A film's thickness is rounded to this, nm, for scales of energy.
THICKNESS_STEP = 1.0
#: Power that comes back of light that would see the material alone, below which nobody sees it.
LEAST_THROUGH = 1e-6

# Ends of what RGB variants sum, nm, and nodes between them a fringe, evenly in 1/λ
_ENDS, _PER_FRINGE, _LEAST_NODES = (390.0, 710.0), 4, 6


@dataclass(frozen=True)
class Channels:
    """Weights (3, n) by which RGB variants sum a film's colours at n wavelengths.

    wavelengths : (n,) nm.
    """

    wavelengths: list[float]
    weights: list[list[float]]

    @classmethod
    def of(cls, path: float) -> Channels:
        """Return weights for fringes of a path there and back (nm), by a cubic spline."""
        first, last = (1.0 / end for end in _ENDS)
        count = _LEAST_NODES + math.ceil(_PER_FRINGE * path * (first - last))
        nodes = np.linspace(last, first, count)
        dense = np.arange(*_ENDS, 1.0)
        rows = linear_srgb(response(dense)).T @ scipy.interpolate.CubicSpline(nodes, np.eye(count))(
            1.0 / dense
        )
        return cls((1.0 / nodes).tolist(), (rows / rows.sum(axis=1, keepdims=True)).tolist())

    def colours(self, values: list[Float]) -> list[Float]:
        """Return the channels of values at the nodes; colours beyond the gamut are clipped at 0."""
        return [
            dr.maximum(sum(w * v for w, v in zip(row, values, strict=True)), 0.0)
            for row in self.weights
        ]


class UnderFilm(Material):
    """Material under a film.

    Parameters
    ----------
    material : the material itself.
    film : the real part of the film's index, relative to the medium above it.
    k : its imaginary part.
    thickness : nm.
    wavelength : nm, of mono variants.
    shortest : shortest wavelength that the table serves, nm.
    """

    layer = Feature.FILM

    def __init__(
        self,
        material: Material,
        film: Dielectric,
        k: float,
        thickness: float,
        wavelength: float,
        shortest: float,
    ) -> None:
        self.material: Material = material
        self.film, self._fixed = film, mi.Float(wavelength)
        dr.make_opaque(self._fixed)
        self._shortest = shortest
        self._k = Bounded("film_k", k, *INDEX_PARTS["k"], _k_refusal)
        self._thickness = Bounded("film_thickness", thickness, 0.0, math.inf, _thickness_refusal)
        self.changeable = (*material.changeable, *film.changeable, self._k, self._thickness)
        self.k, self.thickness = self._k.value, self._thickness.value
        self.sums: Channels | None = None
        self._path = -1.0
        self.derive()

    def indices(self, si: Interaction, active: Mask) -> list[Filmed]:
        """Return the filmed index of each channel; in RGB variants, of each wavelength summed."""
        indices = [_complex(n) for n in self.material.indices(si, active)]
        waves = self._wavelengths(si)
        if self.sums is not None:
            indices = _between(indices, self.sums.wavelengths)
        elif len(indices) == 1:
            indices *= len(waves)
        film, depth = mi.Complex2f(self.film.eta, self.k), self.thickness * (2.0 * dr.pi)
        return [Filmed(n, film, depth * dr.rcp(w)) for n, w in zip(indices, waves, strict=True)]

    def channels(self, values: list[Float]) -> Colour:
        """See `Material.channels`; RGB variants sum over wavelengths."""
        return super().channels(values if self.sums is None else self.sums.colours(values))

    def wavenumbers(self, wavenumbers: list[Float]) -> list[Float]:
        """See `Material.wavenumbers`."""
        if self.sums is None:
            return wavenumbers
        return [mi.Float(k) for k in wavenumber(self.sums.wavelengths).tolist()]

    @property
    def optimised(self) -> bool:
        """Whether derivatives with respect to the thickness are wanted."""
        return bool(dr.grad_enabled(self.thickness))

    def at(self, wavelengths: NDArray[np.float64]) -> Filmed:
        """See `Material.at`; the thickness to `THICKNESS_STEP`."""
        film, thickness = self.numbers()
        rounded = round(thickness / THICKNESS_STEP) * THICKNESS_STEP
        return Filmed(self.material.at(wavelengths), film, 2.0 * np.pi * rounded / wavelengths)

    def refusal(self) -> str | None:
        """Reason why the film is too thick to interfere or opaque, or None."""
        index, thickness = self.numbers()
        if 2.0 * index.real * thickness > COHERENCE:
            return (
                f"film_thickness={thickness:g} nm of index {index.real:.4g}: 2 n d must be at most "
                f"{COHERENCE:g} nm, over which light is coherent (λ²/Δλ of a band of 25 nm at 550 "
                "nm); a thicker layer is a coat: coat_ior"
            )
        if math.exp(-8.0 * math.pi * index.imag * thickness / self._shortest) < LEAST_THROUGH:
            return (
                f"film_k={index.imag:g} at film_thickness={thickness:g} nm absorbs all light on "
                "its way to the material beneath; give the film's index as the material, eta and k"
            )
        return None

    def derive(self) -> None:
        """Derive what depends on indices and thickness: in RGB variants, the wavelengths summed."""
        self.material.derive()
        self.film.derive()
        path = 2.0 * plain(self.film.eta) * plain(self.thickness)
        # Fewer fringes need no other kernels
        if mi.is_rgb and path > self._path:
            self._path, self.sums = path, Channels.of(path)

    @property
    def absorbs(self) -> bool:  # type: ignore[override]
        """Whether the film absorbs light."""
        return plain(self.k) > 0.0

    def numbers(self) -> tuple[complex, float]:
        """The film's index and its thickness, nm."""
        return complex(plain(self.film.eta), plain(self.k)), plain(self.thickness)

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if self.sums is not None:
            return [mi.Float(wavelength) for wavelength in self.sums.wavelengths]
        return list(si.wavelengths) if mi.is_spectral else [self._fixed]

    def __str__(self) -> str:
        index, thickness = self.numbers()
        return f"{self.material} under film[eta = {index:.5g}, {thickness:.5g} nm]"


def _k_refusal(value: float) -> str:
    low, high = INDEX_PARTS["k"]
    return f"film_k={value:g} must be between {low:g} and {high:g}: the film's index is n + ik"


def _thickness_refusal(value: float) -> str:
    return f"film_thickness={value:g} nm must be at least 0"


def _complex(index: Number) -> Number:
    return index if is_complex(index) else mi.Complex2f(index, 0.0)


def _between(values: list[Number], wavelengths: list[float]) -> list[Number]:
    """Interpolate an index from red, green and blue to other wavelengths, constant outside."""
    if len(values) == 1:
        return values * len(wavelengths)
    shares = [np.interp(wavelengths, RGB_WAVELENGTHS[::-1], row) for row in np.eye(3)]
    rows = np.stack(shares[::-1], axis=1).tolist()
    return [sum(n * w for n, w in zip(values, row, strict=True)) for row in rows]
