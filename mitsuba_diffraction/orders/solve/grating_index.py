"""Refractive index of a grating's material over wavelength."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError
from ...optics.materials import PERFECT, material_named
from ...plugin.conductors import tabulated_index
from .dispersion import is_file, read_index


@dataclass(frozen=True, eq=False)
class TabulatedIndex:
    """Complex index n + ik, linear in between, constant beyond.

    Attributes
    ----------
    name : for messages.
    wavelengths : (n,) nm, in vacuum.
    values : (n,) n + ik; None for a perfect conductor.
    """

    name: str
    wavelengths: NDArray[np.float64]
    values: NDArray[np.complex128] | None

    def index(self, wavelength: ArrayLike) -> NDArray[np.complex128] | None:
        """Index at wavelengths in vacuum, nm; None for a perfect conductor."""
        if self.values is None:
            return None
        lam = np.asarray(wavelength, np.float64)
        return np.asarray(np.interp(lam, self.wavelengths, self.values))


def material_of(
    material: str | float | complex | TabulatedIndex, wavelengths: tuple[float, float]
) -> TabulatedIndex:
    """Return a material from a name of `optics.materials`, an index, or "none" (R = 1).

    Raises a DiffractionError if the name is unknown, the index impossible, or its table ends within
    the wavelengths.

    Parameters
    ----------
    material : name such as "Al", number such as 1.5 or 0.6+5.6j, their text, or a file of an index
        (`dispersion`).
    wavelengths : shortest and longest, nm, for which the index must be known.
    """
    if isinstance(material, TabulatedIndex):
        return material
    if is_file(material):
        assert isinstance(material, str)
        return TabulatedIndex(material, *read_index(material, wavelengths))
    number = material_named(material)
    if number == PERFECT:
        return TabulatedIndex("perfect conductor", np.array([0.0]), None)
    if isinstance(number, str):
        nodes, values = tabulated_index(number)
        low, high = wavelengths
        if low < nodes[0] or high > nodes[-1]:
            raise DiffractionError(
                f"material={material!r} is tabulated from {nodes[0]:.0f} to {nodes[-1]:.0f} nm, "
                f"and the wavelengths are {low:g} to {high:g} nm; choose wavelengths within, or "
                "give the index as a number"
            )
        return TabulatedIndex(number, nodes, values)
    return TabulatedIndex(
        f"index {number.real:g}+{number.imag:g}i", np.array([0.0]), np.array([number])
    )
