"""Layers over the structure, and the light for a BSDF beneath it (Dr.Jit).

A flat clear coat (`optics.coat`); a thin film that is coherent with the material, see
`optics.fresnel.Filmed`; and how much light reaches a nested BSDF.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ..optics.arithmetic import is_complex
from ..optics.coat import coated_reflectance, cosine_within, refracted
from ..optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from ..optics.fresnel import Filmed, reflectance
from ..optics.geometry import wavenumber
from .directions import Pair
from .fresnel import INDEX_PARTS, Conductor, Dielectric, Reflectance
from .parameter_changes import Bounded
from .stack import UnderStack
from .types import Callback, Colour, Float, Interaction, Mask, Number, Vector3f


class CoatedPair(Pair):
    """Pair of the directions within a coat.

    `uv` and `w` are optical, for k in vacuum: `w` is n times the sum of the cosines. All else
    belongs to the refracted directions.

    n : index of the coat relative to the medium above it.
    """

    def __init__(self, outer: Pair, n: Float) -> None:
        self._outer, self.n = outer, n
        self.wi, self.wo = (mi.Vector3f(*refracted(w, n)) for w in (outer.wi, outer.wo))
        self.frame, self.uv = outer.frame, outer.uv
        self.cos_i, self.cos_o = self.wi.z, self.wo.z
        self.w = n * (self.cos_i + self.cos_o)
        self.one_plus_dot = 0.5 * dr.squared_norm(self.wi + self.wo)

    @property
    def outer(self) -> Pair:
        """The pair outside."""
        return self._outer


class UnderCoat:
    """Reflectance of the flat faces of a coat and of the material beneath it."""

    def __init__(self, material: Dielectric | Conductor, coat: Dielectric) -> None:
        self.material, self.coat = material, coat
        self.changeable = (*material.changeable, *coat.changeable)

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """Reflectance of coat and material together, for the cosine of the angle outside."""
        face = self.coat.reflectance(cos_theta, si, active)
        inside = cosine_within(cos_theta, self.coat.eta)
        return coated_reflectance(face, self.material.reflectance(inside, si, active))

    def traverse(self, callback: Callback) -> None:
        """Expose the material's index, and the coat's relative to the medium above it."""
        self.material.traverse(callback)
        self.coat.traverse(callback)

    def derive(self) -> None:
        """Derive what depends on the indices of material and coat."""
        self.material.derive()
        self.coat.derive()

    def __str__(self) -> str:
        return f"{self.material} under coat[eta = {dr.slice(self.coat.eta):.5g}]"


#: Steps of an index and of a thickness, nm, for slopes: a fringe advances by less than 0.01 rad.
INDEX_CHANGE, THICKNESS_CHANGE = 1e-4, 0.1
#: Path there and back, nm, over which light interferes: λ²/Δλ at 550 nm of a band of 25 nm.
COHERENCE = 12e3
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
        rows = linear_srgb(response(dense)).T @ CubicSpline(nodes, np.eye(count))(1.0 / dense)
        return cls((1.0 / nodes).tolist(), (rows / rows.sum(axis=1, keepdims=True)).tolist())

    def sums(self, values: list[Float]) -> list[Float]:
        """Return the channels of values at the nodes; colours beyond the gamut are clipped at 0."""
        return [
            dr.maximum(sum(w * v for w, v in zip(row, values, strict=True)), 0.0)
            for row in self.weights
        ]


class FilmChange(NamedTuple):
    """Small change of a film.

    Attributes
    ----------
    number : parameter that is changed.
    step : of the number.
    film : with the number changed.
    """

    number: Float
    step: float
    film: Filmed


class UnderFilm:
    """Material under a film, with the interface of a material.

    Parameters
    ----------
    material : the material itself.
    film : the real part of the film's index, relative to the medium above it.
    k : its imaginary part.
    thickness : nm.
    wavelength : nm, of mono variants.
    shortest : shortest wavelength that the table serves, nm.
    """

    def __init__(
        self,
        material: Dielectric | Conductor,
        film: Dielectric,
        k: float,
        thickness: float,
        wavelength: float,
        shortest: float,
    ) -> None:
        self.material, self.film, self._fixed = material, film, mi.Float(wavelength)
        dr.make_opaque(self._fixed)
        self._shortest = shortest
        self._k = Bounded("film_k", k, *INDEX_PARTS["k"], _k_refusal)
        self._thickness = Bounded("film_thickness", thickness, 0.0, math.inf, _thickness_refusal)
        self.changeable = (*material.changeable, *film.changeable, self._k, self._thickness)
        self.k, self.thickness = self._k.value, self._thickness.value
        self.channels: Channels | None = None
        self._path = -1.0
        self.derive()

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """R of the flat film for the cosine of the angle of incidence, unpolarised."""
        powers = [reflectance(cos_theta, index) for index in self.indices(si, active)]
        return mi.UnpolarizedSpectrum(self.summed(powers))

    def indices(self, si: Interaction, active: Mask) -> list[Filmed]:
        """Return the filmed index of each channel; in RGB variants, of each wavelength summed."""
        indices = [_complex(n) for n in self.material.indices(si, active)]
        waves = self._wavelengths(si)
        if self.channels is not None:
            indices = _between(indices, self.channels.wavelengths)
        elif len(indices) == 1:
            indices *= len(waves)
        film, depth = mi.Complex2f(self.film.eta, self.k), self.thickness * (2.0 * dr.pi)
        return [Filmed(n, film, depth * dr.rcp(w)) for n, w in zip(indices, waves, strict=True)]

    def summed(self, values: list[Float]) -> list[Float]:
        """The channels' values from the values of `indices`."""
        return values if self.channels is None else self.channels.sums(values)

    def wavenumbers(self, wavenumbers: list[Float]) -> list[Float]:
        """Return wavenumbers of `indices`, rad/µm, from the channels' wavenumbers."""
        if self.channels is None:
            return wavenumbers
        return [mi.Float(k) for k in wavenumber(self.channels.wavelengths).tolist()]

    def traverse(self, callback: Callback) -> None:
        """Expose the material's index, and `film_eta`, `film_k` and `film_thickness`."""
        for part in (self.material, self.film, self._k, self._thickness):
            part.traverse(callback)

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
            self._path, self.channels = path, Channels.of(path)

    @property
    def absorbs(self) -> bool:
        """Whether the film absorbs light."""
        return plain(self.k) > 0.0

    def numbers(self) -> tuple[complex, float]:
        """The film's index and its thickness, nm."""
        return complex(plain(self.film.eta), plain(self.k)), plain(self.thickness)

    def changes(self, film: Filmed, wavelengths: NDArray[np.float64]) -> list[FilmChange]:
        """Return changes of a film at wavelengths (nm), one of each number with a derivative."""
        material, index, depth = film.parts
        step, longer = INDEX_CHANGE, 2.0 * np.pi * THICKNESS_CHANGE / wavelengths
        changes = [
            FilmChange(self.film.eta, step, Filmed(material, index + step, depth)),
            FilmChange(self.k, step, Filmed(material, index + 1j * step, depth)),
            FilmChange(self.thickness, THICKNESS_CHANGE, Filmed(material, index, depth + longer)),
        ]
        if isinstance(self.material, Dielectric):
            moved = Filmed(material + step, index, depth)
            changes.append(FilmChange(self.material.eta, step, moved))
        return [change for change in changes if dr.grad_enabled(change.number)]

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if self.channels is not None:
            return [mi.Float(wavelength) for wavelength in self.channels.wavelengths]
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


def plain(number: Float) -> float:
    """Return the number that all lanes share."""
    return float(dr.slice(dr.detach(number)))


LAYERINGS = ("transmission", "thesis")


@dataclass(frozen=True)
class Transmission:
    """f = f_diffraction + T(ωi) T(ωo) f_nested, T = 1 − a of the diffracting surface.

    a(ω) is the albedo of f_diffraction, so that what is not reflected goes on, and a white pair
    reflects at most what it gets. It is taken as the flat interface's reflectance times their
    ratio, which is smooth; under a coat as the flat reflectance alone.
    """

    fresnel: Reflectance | UnderCoat | UnderFilm | UnderStack
    diffraction_share = 1.0

    def beneath(
        self, si: Interaction, wo: Vector3f, active: Mask, ratios: tuple[Colour, Colour]
    ) -> Colour:
        """Factor of the nested BSDF; ratios : of ωi and ωo."""
        inwards, outwards = (
            dr.maximum(1.0 - ratio * self.fresnel.reflectance(cosine, si, active), 0.0)
            for ratio, cosine in zip(
                ratios, (mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)), strict=True
            )
        )
        return inwards * outwards

    def __str__(self) -> str:
        return "transmission"


@dataclass(frozen=True)
class Blend:
    """f = (1 − w) f_diffraction + (1 − α + w) f_nested, α = min(|F|, 1): not physical.

    The texture blending of the thesis of 2014 that first rendered these patches in real time, for
    comparisons with its pictures: F is the reflectance at the half vector, w (`diffuse_weight`) a
    constant for which it gives no value. A white pair gains energy, towards grazing angles most.
    """

    fresnel: Reflectance | UnderCoat | UnderFilm | UnderStack
    weight: float

    @property
    def diffraction_share(self) -> float:
        """Factor of the diffraction."""
        return 1.0 - self.weight

    def beneath(
        self, si: Interaction, wo: Vector3f, active: Mask, ratios: tuple[Colour, Colour]
    ) -> Colour:
        """Factor of the nested BSDF."""
        cos_half = 0.5 * dr.norm(si.wi + wo)
        return 1.0 - self.fresnel.reflectance(cos_half, si, active) + self.weight

    def __str__(self) -> str:
        return f"thesis[diffuse_weight = {self.weight:g}]"


Layering = Transmission | Blend
