"""Fresnel's coefficients of a flat interface in double precision (NumPy; the plugin has Mitsuba's).

Time exp(−iωt), so an absorbing index is n + ik with k ≥ 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Complex = NDArray[np.complex128]


def amplitudes(cos_theta: ArrayLike, index: ArrayLike) -> tuple[Complex, Complex]:
    """Amplitude coefficients (r_s, r_p) of reflection, of opposite signs at normal incidence.

    Born and Wolf, Principles of Optics, section 1.5.2 (eq. 21a); complex index as in section 14.2.

    Parameters
    ----------
    cos_theta : cosine of the angle of incidence, 0 to 1, any shape.
    index : n + ik of the material over that of the medium above it; broadcasts with `cos_theta`.
    """
    cosine, n = np.asarray(cos_theta, np.float64), np.asarray(index, np.complex128)
    inside = decaying_root(n * n - (1.0 - cosine * cosine))  # n cosθ of the refracted wave
    r_s = (cosine - inside) / (cosine + inside)
    r_p = (n * n * cosine - inside) / (n * n * cosine + inside)
    return r_s, r_p


def decaying_root(square: Complex) -> Complex:
    """The root q' whose wave exp(i q' |z|) decays, or else travels, away from the surface."""
    root = np.sqrt(square)
    return np.where(root.imag < 0, -root, root)


def reflectance(cos_theta: ArrayLike, index: ArrayLike) -> NDArray[np.float64]:
    """Fresnel reflectance for unpolarised light, the mean of both polarisations.

    Born and Wolf, Principles of Optics, section 1.5.2 (eq. 20 and 21), with a complex index
    (section 14.2).

    Parameters
    ----------
    cos_theta : cosine of the angle of incidence, 0 to 1, any shape.
    index : n + ik of the material over that of the medium above it; broadcasts with `cos_theta`.
        Infinity is a perfect conductor.
    """
    cosine = np.asarray(cos_theta, np.float64)
    n = np.asarray(index, np.complex128)
    perfect = np.isinf(n)
    r_s, r_p = amplitudes(cosine, np.where(perfect, 1.0, n))
    power = 0.5 * (np.abs(r_s) ** 2 + np.abs(r_p) ** 2)
    return np.where(perfect, 1.0, power)
