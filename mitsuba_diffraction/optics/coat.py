"""A flat clear coat over a structure, too thick for its two faces to interfere (NumPy, float64).

Light is refracted into the coat, diffracted there at λ/n, and refracted out again. Tangential parts
k·u do not change; the normal part n w' of ωi + ωo, in optical units, grows by up to n, and so does
κ. At each passage the face transmits T_s and T_p of the powers of both polarisations (Born and
Wolf, section 1.5.2), and cosθ dω grows by n² on the way out, so that

    f = 1/n² · 4 cosθi' cosθo' · N' / (λ'² A w'²) · ⟨|P|²⟩,   J'_ab = √(T_a(ωo) T_b(ωi) G_ab) J_ab,

and the face itself is a mirror. G sums the light that the face sends back to the structure. Between
two mirrors of reflectances R and ρ the powers add up to 1/(1 − Rρ) (Born and Wolf, section 7.6,
without interference). With ρ_a(ωo), ρ_b(ωi) of the flat structure and the geometric mean of both
directions,

    G_ab = 1 / max(1 − √(R_a ρ_a R_b ρ_b), max(ρ_a, ρ_b) (1 − min(R_a, R_b))).

For a flat structure this sum is exact. It is reciprocal. By the second term T G ρ is at most 1 in
either direction, so a coated structure never reflects more than it receives while the structure
reflects no more than a flat one. Light that the structure sends beyond the critical angle is lost,
although the face returns all of it and some leaves in the end (docs/validation/layers.md).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from .boundary import Complex, Real
from .fresnel import amplitudes


def refracted(direction: ArrayLike, n: float) -> Real:
    """A unit vector (..., 3) above the face as it is in the coat, of relative index n."""
    outside = np.asarray(direction, np.float64)
    x, y = outside[..., 0] / n, outside[..., 1] / n
    return np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], axis=-1)


def matrices(
    model: Callable[..., Complex], wi: ArrayLike, wo: ArrayLike, n: float, index: ArrayLike
) -> Complex:
    """Jones matrices (..., 2, 2) of a model in the coat; arguments as for `transmitted`.

    model : one of `boundary.MODELS`.
    """
    return transmitted(model(refracted(wi, n), refracted(wo, n), index), wi, wo, n, index)


def transmitted(
    jones: ArrayLike, wi: ArrayLike, wo: ArrayLike, n: float, index: ArrayLike
) -> Complex:
    """Jones matrices (..., 2, 2) of the structure in the coat, as seen from outside the coat.

    wi, wo : directions outside the coat, (..., 3).
    index : (...) of the structure over that of the coat.
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
    face, structure = amplitudes(outside[..., 2], n), amplitudes(within, index)
    return _powers(*face), _powers(*structure)


def _powers(r_s: Complex, r_p: Complex) -> Real:
    return np.asarray(np.abs(np.stack([r_s, r_p], axis=-1)) ** 2)
