"""Wrapper of the model: a flat clear coat over the structure (`optics.coat` has the formulas)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Complex, Real
from ..optics.geometry import wavenumber
from . import model
from .fresnel import amplitudes
from .mirror import horizon_correction, interfering, mirror_cosine
from .model import Light
from .screens import Sigmas


def refracted_light(light: Light, coat: float) -> Light:
    """Return the directions, and the wavelength, in a coat of this index."""
    return Light(refracted(light.wi, coat), refracted(light.wo, coat), light.wavelength / coat)


def reflected(
    light: Light,
    sigmas: Sigmas,
    coat: float,
    index: Complex,
    powers: Real,
    jones: Complex,
    measure: Callable[[Complex], Real],
) -> Real:
    """Light from the coated structure, and from the coat's own face.

    Parameters
    ----------
    light : outside of the coat.
    index : of the structure relative to the coat.
    powers : ⟨|P|²⟩ of the structure in the coat (`integral.window_powers`).
    jones : J of the structure in the coat.
    """
    inside = refracted_light(light, coat)
    ends, sigma, sigma_0 = (light.wi, light.wo, coat, index), sigmas.orders, sigmas.zeroth
    others = model.reflected(inside, sigma, powers[0] / coat**2, transmitted(jones, *ends), measure)
    beneath = beneath_amplitudes(mirror_cosine(light, sigma_0), coat, index)
    mirror = model.facets(inside.wi, inside.wo, *beneath)
    visible = horizon_correction(light, sigma_0)
    area = (light.wavelength * 1e-3) ** 2 * np.pi * sigma**2
    zeroth = (visible * powers[1] / area * measure(mirror).T).T
    # The face is a mirror: ⟨|P|²⟩ of a flat patch
    tangential = (light.wi + light.wo)[:, :2]
    lobe = np.exp(-((sigma_0 * wavenumber(light.wavelength)) ** 2) * np.sum(tangential**2, axis=1))
    flat = 4 * np.pi**2 * sigma**2 * sigma_0**2 * lobe
    face = np.full(len(flat), coat, complex)
    structure = interfering(others, zeroth, powers[2])
    return structure + model.mirrored(light, sigmas, flat, face, measure)


def beneath_amplitudes(cosine: Real, n: float, index: Complex) -> tuple[Complex, Complex]:
    """r_s and r_p (...) of a flat structure under a coat, as seen from outside.

    cosine : (...) of the angle outside.
    """
    within = np.sqrt(np.maximum(cosine**2 + n**2 - 1.0, 0.0)) / n
    found = []
    for face, structure in zip(amplitudes(cosine, n), amplitudes(within, index), strict=True):
        back = np.abs(face) ** 2
        bounces = np.maximum(1.0 - back * np.abs(structure) ** 2, 1e-12)
        found.append(structure * (1.0 - back) / np.sqrt(bounces))
    return found[0], found[1]


def refracted(direction: ArrayLike, n: float) -> Real:
    """A unit vector (..., 3) above the face as it is in the coat, of relative index n."""
    outside = np.asarray(direction, np.float64)
    x, y = outside[..., 0] / n, outside[..., 1] / n
    return np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], axis=-1)


def transmitted(
    jones: ArrayLike, wi: ArrayLike, wo: ArrayLike, n: float, index: ArrayLike
) -> Complex:
    """Jones matrices (..., 2, 2) of the structure in the coat, as seen from outside the coat.

    wi, wo : directions outside the coat, (..., 3).
    index : (...) of the structure relative to the coat.
    """
    (back0, sent0), (back, sent) = (_mirrors(np.asarray(w, np.float64), n, index) for w in (wi, wo))
    passed = (1.0 - back)[..., :, None] * (1.0 - back0)[..., None, :]
    both = np.sqrt((back * sent)[..., :, None] * (back0 * sent0)[..., None, :])
    most = np.maximum(sent[..., :, None], sent0[..., None, :])
    least = most * (1.0 - np.minimum(back[..., :, None], back0[..., None, :]))
    matrix = np.asarray(jones, np.complex128)
    return np.asarray(np.sqrt(passed / np.maximum(1.0 - both, least)) * matrix)


def _mirrors(outside: Real, n: float, index: ArrayLike) -> tuple[Real, Real]:
    """R_s and R_p of the face, the same from both sides, and of the flat structure, (..., 2)."""
    within = refracted(outside, n)[..., 2]
    both = amplitudes(outside[..., 2], n), amplitudes(within, index)
    face, structure = (np.asarray(np.abs(np.stack(pair, axis=-1)) ** 2) for pair in both)
    return face, structure
