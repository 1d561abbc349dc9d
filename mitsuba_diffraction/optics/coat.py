"""A flat clear coat over a structure, too thick for its two faces to interfere (NumPy, float64).

Light is refracted into the coat, diffracted there at λ/n, and refracted out again. Tangential parts
k·u stay what they are; the normal part of ωi + ωo in optical units, n w', grows by up to n, and so
does κ. Each way the face transmits the shares T_s and T_p of the powers of both polarisations
(Born and Wolf, section 1.5.2), and cosθ dω grows by n² on the way out, so that

    f = 1/n² · 4 cosθi' cosθo' · N' / (λ'² A w'²) · ⟨|P|²⟩,   J' = √T(ωo) J(ωi', ωo') √T(ωi),

and the face itself is a mirror. Light that the structure sends back to the face, and the face to
the structure, is left out: for a clear coat under air that loses, and never gains.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .boundary import Complex, Real
from .fresnel import amplitudes


def refracted(direction: ArrayLike, n: float) -> Real:
    """A unit vector (..., 3) above the face as it is in the coat, of relative index n."""
    outside = np.asarray(direction, np.float64)
    x, y = outside[..., 0] / n, outside[..., 1] / n
    return np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], axis=-1)


def transmitted(jones: ArrayLike, wi: ArrayLike, wo: ArrayLike, n: float) -> Complex:
    """Jones matrices (..., 2, 2) of the structure in the coat, between the faces' two passages.

    wi, wo : directions outside the coat, (..., 3).
    """
    before, after = (np.asarray(w, np.float64)[..., 2] for w in (wi, wo))
    matrix = np.asarray(jones, np.complex128)
    return np.asarray(_roots(after, n)[..., :, None] * matrix * _roots(before, n)[..., None, :])


def _roots(cosine: Real, n: float) -> Real:
    """√T_s and √T_p of light at this angle outside, (..., 2); the same both ways."""
    r_s, r_p = amplitudes(cosine, n)
    return np.sqrt(1.0 - np.abs(np.stack([r_s, r_p], axis=-1)) ** 2)
