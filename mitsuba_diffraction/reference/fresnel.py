"""Fresnel's coefficients of a flat interface, bare or under a thin film (NumPy, float64).

The judge of `optics.fresnel`, with roots and exponentials of complex numbers. Time exp(−iωt), so an
absorbing index is n + ik with k ≥ 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Complex, Real
from ..optics.fresnel import Filmed, Index


@dataclass(frozen=True)
class InterfaceFields:
    """Fields at one interface for light that comes down with unit amplitude, over twice its cosine.

    Attributes
    ----------
    contrast : ε below less ε above.
    normal : weight of the product of normal fields.
    s : electric field of s light.
    x, p : tangential field of p light, and its magnetic one over that medium's ε.
    """

    contrast: Complex
    normal: Complex
    s: Complex
    x: Complex
    p: Complex


def faces(cosine: ArrayLike, squared_sine: ArrayLike, index: Index) -> list[InterfaceFields]:
    """Return fields at the interface of a material, or at both interfaces of its film.

    Films follow Born and Wolf, Principles of Optics, section 1.6.4.
    """
    q, square = np.asarray(cosine, np.float64), np.asarray(squared_sine, np.float64)
    if not isinstance(index, Filmed):
        n = np.asarray(index, np.complex128)
        epsilon = n * n
        inside = decaying_root(epsilon - square)
        p = 1.0 / (epsilon * q + inside)
        return [InterfaceFields(epsilon - 1.0, epsilon, 1.0 / (q + inside), inside * p, p)]
    epsilon, film, within, once, back_s, back_p = _film(square, index)
    there_s, there_p = back_s * once * once, back_p * once * once
    s = 1.0 / (q + within + (q - within) * there_s)
    p = 1.0 / (film * q + within + (film * q - within) * there_p)
    return [
        InterfaceFields(
            film - 1.0, film, s * (1 + there_s), within * p * (1 - there_p), p * (1 + there_p)
        ),
        InterfaceFields(
            epsilon - film,
            film / epsilon,
            s * once * (1 + back_s),
            within * p * once * (1 - back_p),
            p * once * (1 + back_p),
        ),
    ]


def _film(square: Real, index: Filmed) -> tuple[Complex, ...]:
    """ε of material and film, q of the film, one passage's phase, r_s and r_p of the lower face."""
    material, film, depth = index.parts
    epsilon, layer = material * material, film * film
    below, within = decaying_root(epsilon - square), decaying_root(layer - square)
    r_s = (within - below) / (within + below)
    r_p = (epsilon * within - layer * below) / (epsilon * within + layer * below)
    return epsilon, layer, within, np.exp(1j * within * depth), r_s, r_p


def amplitudes(cos_theta: ArrayLike, index: Index) -> tuple[Complex, Complex]:
    """Amplitude coefficients (r_s, r_p) of reflection, of opposite signs at normal incidence.

    Born and Wolf, Principles of Optics, section 1.5.2 (eq. 21a); complex index as in section 14.2;
    films as in section 1.6.4, from the upper face.

    Parameters
    ----------
    cos_theta : cosine of the angle of incidence, 0 to 1, any shape.
    index : n + ik of the material relative to the medium above it; broadcasts with `cos_theta`.
        Infinity is a perfect conductor.
    """
    cosine = np.asarray(cos_theta, np.float64)
    if isinstance(index, Filmed):
        _, film, within, once, back_s, back_p = _film(1.0 - cosine * cosine, index)
        pairs = (cosine, back_s), (film * cosine, back_p)
        r_s, r_p = (
            (q - within + (q + within) * back * once * once)
            / (q + within + (q - within) * back * once * once)
            for q, back in pairs
        )
        return r_s, r_p
    n = np.asarray(index, np.complex128)
    perfect = np.isinf(n)
    n = np.where(perfect, 1.0, n)
    inside = decaying_root(n * n - (1.0 - cosine * cosine))  # n cosθ of the refracted wave
    r_s = (cosine - inside) / (cosine + inside)
    r_p = (n * n * cosine - inside) / (n * n * cosine + inside)
    return np.where(perfect, -1.0, r_s), np.where(perfect, 1.0, r_p)


def decaying_root(square: Complex) -> Complex:
    """The root q' whose wave exp(i q' |z|) decays, or else travels, away from the surface."""
    root = np.sqrt(square)
    return np.where(root.imag < 0, -root, root)


def reflectance(cos_theta: ArrayLike, index: Index) -> Real:
    """Fresnel reflectance for unpolarised light, the mean of both polarisations.

    Born and Wolf, Principles of Optics, section 1.5.2 (eq. 20 and 21), with a complex index
    (section 14.2). Parameters as of `amplitudes`.
    """
    r_s, r_p = amplitudes(cos_theta, index)
    return np.asarray(0.5 * (np.abs(r_s) ** 2 + np.abs(r_p) ** 2))
