"""Power reflectance of a flat interface in double precision (NumPy; the plugin has Mitsuba's)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


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
    n = np.where(perfect, 1.0, n)
    inside = np.sqrt(n * n - (1.0 - cosine * cosine))  # n cosθ of the refracted wave
    te = (cosine - inside) / (cosine + inside)
    tm = (n * n * cosine - inside) / (n * n * cosine + inside)
    power = 0.5 * (np.abs(te) ** 2 + np.abs(tm) ** 2)
    return np.where(perfect, 1.0, power)
