"""Media around a profile: films on it, slices beneath it, and the substrate below them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from .grating_index import TabulatedIndex


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

    @property
    def lengths(self) -> tuple[float, ...]:
        """All lengths, µm, which with the materials identify the structure."""
        lengths: list[float] = [len(self.films), *(film.thickness for film in self.films)]
        for thickness, parts in self.slices:
            lengths += [thickness, len(parts)]
            lengths += [end for part in parts for end in (part.begin, part.end)]
        return tuple(lengths)
