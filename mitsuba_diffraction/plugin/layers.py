"""Layers over the structure: a flat clear coat (`optics.coat`), and a thin film (Dr.Jit).

A film is coherent with the material, see `optics.fresnel.Filmed`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import DiffractionError, warn
from ..files import readable_file
from ..optics.arithmetic import is_complex
from ..optics.coat import coated_reflectance, cosine_within
from ..optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from ..tables import DiffractionTable
from .arithmetic import plain
from .description import Feature
from .materials import INDEX_PARTS, Conductor, Dielectric, IndexAt, Material
from .pigment import PICTURES
from .properties import number, resolved_path
from .types import Colour, Float, Interaction, Mask, Number, Properties, Texture
from .varying import Varying


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


#: Thicknesses, nm, where a texture of film_thickness is 0 and 1.
FILM_ENDS = ("film_thickness_min", "film_thickness_max")
#: Path 2 n d in a film on a metal (nm) times RMS height (µm) from which on colours deviate by 10 %
#: in light from 60°: by docs/make/validation/filmed.py 7 % of 37, 19 % of 59 and 32 % of 74.
ROUGH = 45.0
#: Path there and back, nm, over which light interferes: λ²/Δλ at 550 nm of a band of 25 nm.
COHERENCE = 12e3
#: A film's thickness is rounded to this, nm, for scales of energy.
THICKNESS_STEP = 1.0
#: The same while derivatives by the thickness are taken: each step costs seconds.
OPTIMISED_STEP = 5.0
#: Thicknesses, in a fringe of the shortest wavelength, between which scales of energy are linear.
#: Light that a film on silver guides at 86° is sent on 1.06 times in between; with 6, 1.5 times.
FRINGE = 16
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


class Thickness(Varying):
    """Thickness of a film, nm: a number, or by a texture of 0 to 1 between two thicknesses.

    Parameters
    ----------
    value : number, or raw texture or mesh attribute of one channel.
    ends : thicknesses where a texture is 0 and 1.

    Attributes
    ----------
    beyond : factor by which the largest thickness of `places` is above all others, and the smallest
        below them.
    """

    beyond = 1.0

    def __init__(self, value: float | Texture, ends: tuple[float, float]) -> None:
        self._ends = ends
        self._first, self._rise = mi.Float(ends[0]), mi.Float(ends[1] - ends[0])
        dr.make_opaque(self._first, self._rise)
        high, unit = (1.0, "") if isinstance(value, mi.Texture) else (COHERENCE, " nm")
        super().__init__("film_thickness", value, 0.0, high, unit=unit)

    def at(self, si: Interaction, active: Mask) -> Float:
        """See `Varying.at`."""
        value = super().at(si, active)
        return value if self.texture is None else dr.fma(value, self._rise, self._first)

    def places(self, step: float) -> list[float]:
        """Return even thicknesses over a texture's, `step` apart at most."""
        first, last = self.tabulated
        return np.linspace(first, last, 2 + math.floor((last - first) / step)).tolist()

    @property
    def tabulated(self) -> tuple[float, float]:
        """Smallest and largest of `places`."""
        return min(self._ends) / self.beyond, max(self._ends) * self.beyond

    @property
    def number(self) -> float:
        """The thickness, or the largest of a texture's."""
        return super().number if self.texture is None else max(self._ends)

    def range(self) -> tuple[float, float]:
        """Return the smallest and the largest thickness."""
        return super().range() if self.texture is None else (min(self._ends), max(self._ends))


def thickness_of(props: Properties) -> Thickness:
    """Return the thickness of a film: a number, or a texture of 0 to 1 between two of them.

    The name of a picture stands for its texture.

    Raises a DiffractionError if a texture lacks its thicknesses, or a number has them.
    """
    name, ends = "film_thickness", [each for each in FILM_ENDS if each in props]
    value = dict(props.objects()).get(name)
    text = str(props.get(name)) if value is None else ""
    if Path(text).suffix.lower() in PICTURES:
        file = readable_file(resolved_path(text, name))
        value = mi.load_dict({"type": "bitmap", "filename": str(file), "raw": True})
    if isinstance(value, mi.Texture):
        if FILM_ENDS[1] not in ends:
            raise DiffractionError(
                f"{name} is a texture of 0 to 1 between {FILM_ENDS[0]} (0 by default) and "
                f"{FILM_ENDS[1]}; give {FILM_ENDS[1]}, the thickness where it is 1, in nm"
            )
        first, last = (number(props, each, 0.0) for each in FILM_ENDS)
        for each, end in zip(FILM_ENDS, (first, last), strict=True):
            if end < 0.0:
                raise DiffractionError(f"{each}={end:g} nm must be at least 0 nm")
        return Thickness(value, (first, last))
    if ends:
        raise DiffractionError(f"{ends[0]} is for a {name} that is a texture")
    advice = f", a texture, or a picture ({', '.join(PICTURES)}) of 0 to 1"
    return Thickness(number(props, name, 0.0, advice), (0.0, 0.0))


class UnderFilm(Material):
    """Material under a film.

    Parameters
    ----------
    material : the material itself.
    film : the real part of the film's index, relative to the medium above it.
    k : its imaginary part.
    thickness : of the film.
    wavelength : nm, of mono variants.
    wavelength_range : shortest and longest wavelength that the table serves, nm.
    """

    layer = Feature.FILM

    def __init__(
        self,
        material: Material,
        film: Dielectric,
        k: float,
        thickness: Thickness,
        wavelength: float,
        wavelength_range: tuple[float, float],
    ) -> None:
        self.material: Material = material
        self.film, self._fixed = film, mi.Float(wavelength)
        dr.make_opaque(self._fixed)
        self._range, self.thickness = wavelength_range, thickness
        self.varying = thickness if thickness.texture else None
        absorption = Varying("film_k", k, *INDEX_PARTS["k"], advice=": the film's index is n + ik")
        self.changeable = (*material.changeable, *film.changeable, absorption, thickness)
        self.k = absorption.value
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
        film = mi.Complex2f(self.film.eta, self.k)
        depth = self.thickness.at(si, active) * (2.0 * dr.pi)
        return [Filmed(n, film, depth * dr.rcp(w)) for n, w in zip(indices, waves, strict=True)]

    def channels(self, values: list[Float]) -> Colour:
        """See `Material.channels`; RGB variants sum over wavelengths."""
        return super().channels(values if self.sums is None else self.sums.colours(values))

    def wavenumbers(self, wavenumbers: list[Float]) -> list[Float]:
        """See `Material.wavenumbers`."""
        if self.sums is None:
            return wavenumbers
        return [mi.Float(k) for k in wavenumber(self.sums.wavelengths).tolist()]

    def at(self, wavelengths: NDArray[np.float64]) -> Filmed:
        """See `Material.at`; of the largest thickness, to `THICKNESS_STEP`."""
        return self._of_thickness(self.thickness.number, wavelengths)

    def everywhere(self) -> list[IndexAt]:
        """See `Material.everywhere`."""
        if self.thickness.texture is None and self.thickness.differentiable:
            steps = max(round(self.thickness.number / OPTIMISED_STEP), 1)
            return [partial(self._of_thickness, steps * OPTIMISED_STEP)]
        if self.thickness.texture is None:
            return [self.at]
        fringe = self._range[0] / (2.0 * self.numbers()[0].real)
        return [partial(self._of_thickness, d) for d in self.thickness.places(fringe / FRINGE)]

    def _of_thickness(self, thickness: float, wavelengths: NDArray[np.float64]) -> Filmed:
        rounded = round(thickness / THICKNESS_STEP) * THICKNESS_STEP
        depth = 2.0 * np.pi * rounded / wavelengths
        return Filmed(self.material.at(wavelengths), self.numbers()[0], depth)

    def refusal(self) -> str | None:
        """Reason why the film is too thick to interfere or opaque, or None."""
        index, thickness = self.numbers()
        if 2.0 * index.real * thickness > COHERENCE:
            return (
                f"film_thickness={thickness:g} nm of film_eta={index.real:.4g} (film_ior): 2 n d "
                f"must be at most {COHERENCE:g} nm, over which light is coherent (λ²/Δλ of a band "
                "of 25 nm at 550 nm); a thicker layer is a coat: coat_ior"
            )
        if math.exp(-8.0 * math.pi * index.imag * thickness / self._range[0]) < LEAST_THROUGH:
            return (
                f"film_k={index.imag:g} at film_thickness={thickness:g} nm absorbs all light on "
                "its way to the material beneath; give the film's index as the material, eta and k"
            )
        return None

    def derive(self) -> None:
        """Derive what depends on indices and thickness: in RGB variants, the wavelengths summed."""
        self.material.derive()
        self.film.derive()
        path = 2.0 * plain(self.film.eta) * self.thickness.number
        # Fewer fringes need no other kernels
        if mi.is_rgb and path > self._path:
            self._path, self.sums = path, Channels.of(path)

    @property
    def absorbs(self) -> bool:  # type: ignore[override]
        """Whether the film absorbs light."""
        return plain(self.k) > 0.0

    def numbers(self) -> tuple[complex, float]:
        """The film's index and its thickness, the largest where it varies, nm."""
        return complex(plain(self.film.eta), plain(self.k)), self.thickness.number

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if self.sums is not None:
            return [mi.Float(wavelength) for wavelength in self.sums.wavelengths]
        return list(si.wavelengths) if mi.is_spectral else [self._fixed]

    def __str__(self) -> str:
        ends = " to ".join(f"{d:.5g}" for d in dict.fromkeys(self.thickness.range()))
        return f"{self.material} under film[eta = {self.numbers()[0]:.5g}, {ends} nm]"


def warn_of_film(material: Material, table: DiffractionTable, scale: float) -> None:
    """Warn of a film whose fringes are finer than the model can follow on these heights."""
    if not isinstance(material, UnderFilm) or not isinstance(material.material, Conductor):
        return
    index, thickness = material.numbers()
    rms = scale * math.sqrt(float(table.roughness.nodes.max()))
    if 2.0 * index.real * thickness * rms > ROUGH:
        warn(
            f"film_thickness={thickness:g} nm on a metal of RMS height {1e3 * rms:.0f} nm: beside "
            "rigorous solutions, expect the colours to be off by more than 10 % beyond 60° from "
            "the normal (docs/validation.md)"
        )


def _complex(index: Number) -> Number:
    return index if is_complex(index) else mi.Complex2f(index, 0.0)


def _between(values: list[Number], wavelengths: list[float]) -> list[Number]:
    """Interpolate an index from red, green and blue to other wavelengths, constant outside."""
    if len(values) == 1:
        return values * len(wavelengths)
    shares = [np.interp(wavelengths, RGB_WAVELENGTHS[::-1], row) for row in np.eye(3)]
    rows = np.stack(shares[::-1], axis=1).tolist()
    return [sum(n * w for n, w in zip(values, row, strict=True)) for row in rows]
