"""Wrapper of the model: a flat clear coat over the structure (`optics.coat` has the formulas)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..optics.coat import refracted, transmitted
from ..optics.geometry import wavenumber
from . import model
from .model import Light

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def refracted_light(light: Light, coat: float) -> Light:
    """Return the directions, and the wavelength, in a coat of this index."""
    return Light(refracted(light.wi, coat), refracted(light.wo, coat), light.wavelength / coat)


def reflected(
    light: Light,
    sigma: float,
    coat: float,
    index: Complex,
    power: Real,
    jones: Complex,
    measure: Callable[[Complex], Real],
) -> Real:
    """Light from the coated structure, and from the coat's own face.

    Parameters
    ----------
    light : outside of the coat.
    index : of the structure over that of the coat.
    power, jones : ⟨|P|²⟩ and J of the structure in the coat.
    """
    inside = refracted_light(light, coat)
    outside = transmitted(jones, light.wi, light.wo, coat, index)
    structure = model.reflected(inside, sigma, power / coat**2, outside, measure)
    # The face is a mirror: ⟨|P|²⟩ of a flat patch
    tangential = (light.wi + light.wo)[:, :2]
    lobe = np.exp(-((sigma * wavenumber(light.wavelength)) ** 2) * np.sum(tangential**2, axis=1))
    face = model.kirchhoff(light, np.asarray(coat, complex))
    flat = 4 * np.pi**2 * sigma**4 * lobe
    return structure + model.reflected(light, sigma, flat, face, measure)
