"""Media around a profile: films on it, slices beneath it, and the substrate below them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...errors import DiffractionError, check_keys, quoted
from ...files import read_toml
from ...heights.lengths import count_between, number_between
from ...limits import MOST_LAYERS, check_count
from .grating_index import TabulatedIndex, material_of
from .profiles import Profile

Substance = str | float | complex | TabulatedIndex
#: Layers, from the material upwards: material and thickness in µm. Slices, beneath a profile, are a
#: thickness and parts, of a material and the x in µm at which it begins and ends.
Layers = Sequence[tuple[Any, ...]]
# Logarithm by which an opaque layer weakens the amplitude of light there and back, at least.
_OPAQUE = 3.0


class ProfileFilm(NamedTuple):
    """Film on a profile, as thick along z everywhere; thickness in µm."""

    material: TabulatedIndex
    thickness: float


class Part(NamedTuple):
    """Rectangle of a slice, from x = begin to end in µm; end may lie in the next period."""

    material: TabulatedIndex
    begin: float
    end: float


class Slice(NamedTuple):
    """Slab with vertical walls, thickness in µm; the medium above the grating fills its gaps."""

    thickness: float
    parts: tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class Structure:
    """All media of a grating but the profile's material and the medium above.

    Attributes
    ----------
    films : on the profile, from its material upwards.
    slices : beneath the lowest point of the profile, from the substrate upwards.
    substrate : below the slices; None is the profile's material.
    """

    films: tuple[ProfileFilm, ...] = ()
    slices: tuple[Slice, ...] = ()
    substrate: TabulatedIndex | None = None

    def __bool__(self) -> bool:
        """Whether any medium is added."""
        return bool(self.films or self.slices or self.substrate)

    @property
    def is_beneath(self) -> bool:
        """Whether media lie beneath the profile's material."""
        return bool(self.slices or self.substrate)

    @property
    def materials(self) -> tuple[TabulatedIndex, ...]:
        """Materials of the films, of the slices' parts, and of the substrate, in this order."""
        parts = (part.material for layer in self.slices for part in layer.parts)
        substrate = () if self.substrate is None else (self.substrate,)
        return (*(film.material for film in self.films), *parts, *substrate)

    def fringes(self, wavelength: float) -> tuple[float, str]:
        """Return the distance of fringes of the layers, nm, infinite without, and a line on it.

        Layers beneath an opaque one have none. wavelength : in vacuum, nm.
        """
        films = ((film.thickness, [film.material]) for film in reversed(self.films))
        slices = ((each.thickness, [p.material for p in each.parts]) for each in self.slices[::-1])
        path = 0.0
        for thickness, materials in (*films, *slices):
            indices = [complex(np.asarray(each.index(wavelength))) for each in materials]
            index = max(indices, key=lambda n: n.real, default=1.0 + 0.0j)
            path += 2.0 * thickness * index.real
            if 4e3 * np.pi * thickness * index.imag > _OPAQUE * wavelength:
                break
        apart = 1e-3 * wavelength**2 / path if path else np.inf
        return apart, (
            f"2 Σ n d of the layers is {path:.3g} µm (thicknesses are in µm), with fringes "
            f"{apart:.2g} nm apart at {wavelength:g} nm"
        )


def structure_of(
    profile: Profile,
    substance: TabulatedIndex,
    wavelengths: tuple[float, float],
    *,
    layers: Layers = (),
    beneath: Layers = (),
    substrate: Substance | None = None,
    thin: bool = False,
) -> Structure:
    """Return the films of layers on a profile, and the slices beneath it.

    Raises a DiffractionError if a length or material is out of its range, parts of a slice overlap,
    or the profile's material is a perfect conductor or a thin sheet.

    Parameters
    ----------
    profile, substance : and its material.
    wavelengths : shortest and longest, nm, for which indices must be known.
    layers : on the profile.
    beneath : layers and slices, from the substrate upwards.
    substrate : below them; None is the profile's material.
    """
    films = tuple(_film(layer, f"layer {n}", wavelengths) for n, layer in enumerate(layers, 1))
    slices = tuple(
        _slice(layer, f"beneath {n}", wavelengths, profile.period)
        for n, layer in enumerate(beneath, 1)
    )
    lowest = None if substrate is None else _index(substrate, "substrate", wavelengths)
    structure = Structure(films, slices, lowest)
    if structure and (thin or substance.values is None):
        raise DiffractionError(
            "layers lie on, and beneath, a material with an index, and not thin sheets or perfect "
            "conductors"
        )
    return structure


def read_layers(path: str | os.PathLike[str]) -> Layers:
    """Read layers and slices from a file (TOML): `layers`, a list of them, and `repeat`.

        layers = [["chitin", 0.09], [0.06, ["chitin", 0.1, 0.3], ["melanin", 0.3, 0.4]]]
        repeat = 5

    A thickness alone is a slice of the medium above. `layers` of `diffraction` reads such files,
    without slices.

    Raises a DiffractionError if the file cannot be read, or a key or value is not allowed.
    """
    shown = repr(os.fspath(path))
    content = read_toml(path)
    check_keys(shown, content, ("layers", "repeat"))
    repeat = count_between(content.get("repeat", 1), f"{shown}: repeat", 1, MOST_LAYERS)
    layers = checked_layers(content.get("layers"), f"{shown}: layers")
    if not layers:
        raise DiffractionError(f"{shown}: 0 layers; expected 1 to {MOST_LAYERS}")
    check_count(len(layers) * repeat, MOST_LAYERS, shown, "layers")
    return tuple(layers) * repeat


def checked_layers(value: Any, shown: str) -> Layers:
    """Return a list of TOML as layers and slices.

    Raises a DiffractionError if it has another form.
    """
    if not (isinstance(value, list) and all(isinstance(layer, list) and layer for layer in value)):
        raise DiffractionError(
            f'{shown}: expected layers such as ["SiO2", 0.1], material and µm, or slices such as '
            f'[0.1, ["SiO2", 0.2, 0.5]], µm and parts of material, begin and end; got '
            f"{quoted(value)}"
        )
    return tuple(tuple(layer) for layer in value)


def _film(layer: Sequence[Any], where: str, wavelengths: tuple[float, float]) -> ProfileFilm:
    """Return a layer, (material, thickness), on a profile."""
    if len(layer) != 2 or not isinstance(layer[1], float | int):
        raise DiffractionError(
            f"{where}: expected a material and a thickness in µm, got {quoted(layer)}; slices lie "
            "beneath a profile"
        )
    return ProfileFilm(_index(layer[0], where, wavelengths), _thickness(layer[1], where))


def _slice(
    layer: Sequence[Any], where: str, wavelengths: tuple[float, float], period: float
) -> Slice:
    """Return a layer, (material, thickness), or a slice, (thickness, parts …)."""
    if len(layer) == 2 and isinstance(layer[1], float | int):
        material, thickness = _film(layer, where, wavelengths)
        return Slice(thickness, (Part(material, 0.0, period),))
    if not all(isinstance(part, list | tuple) and len(part) == 3 for part in layer[1:]):
        raise DiffractionError(
            f"{where}: parts are a material, and the x in µm at which it begins and ends, such as "
            f'["SiO2", 0.2, 0.5]; got {quoted(layer[1:])}'
        )
    parts = tuple(
        Part(
            _index(material, where, wavelengths),
            number_between(begin, f"{where}: begin", 0.0, period, " µm"),
            number_between(end, f"{where}: end", 0.0, 2.0 * period, " µm"),
        )
        for material, begin, end in layer[1:]
    )
    _check_parts(parts, where, period)
    return Slice(_thickness(layer[0], where), parts)


def _check_parts(parts: Iterable[Part], where: str, period: float) -> None:
    """Refuse parts without width, and such that overlap, also across the period's end."""
    ordered = sorted(parts, key=lambda part: part.begin)
    for n, part in enumerate(ordered):
        following = ordered[n + 1].begin if n + 1 < len(ordered) else ordered[0].begin + period
        if not part.begin < part.end <= following + 1e-9 * period:
            raise DiffractionError(
                f"{where}: {part.material.name} from {part.begin:g} to {part.end:g} µm must end "
                f"after its beginning, and before the next part begins, at {following:g} µm"
            )


def _index(material: Any, where: str, wavelengths: tuple[float, float]) -> TabulatedIndex:
    """Return a material that has an index."""
    try:
        if not isinstance(material, str | int | float | complex | TabulatedIndex):
            raise DiffractionError(f"expected a material, got {quoted(material)}")
        known = material_of(material, wavelengths)
    except DiffractionError as error:
        raise DiffractionError(f"{where}: {error}") from error
    if known.values is None:
        raise DiffractionError(f"{where}: a layer needs an index; a perfect conductor has none")
    return known


def _thickness(value: Any, where: str) -> float:
    return number_between(value, f"{where}: thickness", 1e-4, 100, " µm")
