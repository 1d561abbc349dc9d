"""Jones and Mueller matrices, and the axes that they are about (NumPy, float64).

Conventions: time is exp(−iωt), so an absorbing index is n + ik with k ≥ 0. Light travels along
d = −ωi, then along d = ωo. The axes are s = ẑ×d/|ẑ×d| and p = d×s, so that (s, p, d) is
right-handed, as Mitsuba's bases are. Then r_s and r_p of a mirror have opposite signs at normal
incidence. Row 0 and column 0 of a matrix are s, row 1 and column 1 are p: E_out = J E_in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Complex, Real

# sinθ below which a direction is the normal itself: its azimuth is rounding
_NORMAL = 1e-12


def polarisation_axes(wi: ArrayLike, wo: ArrayLike) -> tuple[Real, Real]:
    """Unit vectors s = ẑ×d/|ẑ×d| of the incident and the outgoing light, (..., 3) each.

    Along the normal any axis would do: s is taken from the other direction, or y if both directions
    are the normal (light in the x–z plane).
    """
    incident, outgoing = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    incident, outgoing = np.broadcast_arrays(incident, outgoing)
    s_in, slanted_in = _horizontal(-incident)
    s_out, slanted_out = _horizontal(outgoing)
    y = np.array([0.0, 1.0, 0.0])
    first = np.where(slanted_in, s_in, np.where(slanted_out, s_out, y))
    return first, np.where(slanted_out, s_out, first)


def unpolarised(jones: ArrayLike) -> Real:
    """N = ½ Σ|J|², the power of unpolarised light of power 1 after `jones`, (...)."""
    entries = np.asarray(jones, np.complex128)
    return np.asarray(0.5 * np.sum(np.abs(entries) ** 2, axis=(-2, -1)), np.float64)


def mueller(jones: ArrayLike) -> Real:
    """Mueller matrices (..., 4, 4) of Jones matrices, for Mitsuba's Stokes vectors.

    S = (|E_s|²+|E_p|², |E_s|²−|E_p|², 2 Re E_s E_p*, 2 Im E_s E_p*): with axes (s, p, d) and time
    as above, S₃ > 0 turns clockwise for an observer who looks into the light.
    """
    entries = np.asarray(jones, np.complex128)
    # E_out ⊗ E_out* = (J ⊗ J*) (E_in ⊗ E_in*), and the Stokes vector is linear in that product
    pairs = np.einsum("...ik,...jl->...ijkl", entries, entries.conj())
    coherency = pairs.reshape(*entries.shape[:-2], 4, 4)
    stokes = np.array([[1, 0, 0, 1], [1, 0, 0, -1], [0, 1, 1, 0], [0, -1j, 1j, 0]])
    return np.asarray((stokes @ coherency @ np.linalg.inv(stokes)).real, np.float64)


def _horizontal(direction: Real) -> tuple[Real, NDArray[np.bool_]]:
    """ẑ×d normalised (arbitrary along the normal), and whether d differs from the normal."""
    x, y = direction[..., 0], direction[..., 1]
    length = np.hypot(x, y)
    slanted = length > _NORMAL
    safe = np.where(slanted, length, 1.0)
    return np.stack([-y / safe, x / safe, np.zeros_like(x)], axis=-1), slanted[..., None]


def facet_axis(incident: Real, outgoing: Real, fallback: Real) -> Real:
    """s of a facet that mirrors ωi to ωo, normal to both; `fallback` where they are parallel."""
    # (ωi+ωo)×(−ωi) = ωi×ωo: the direction of ẑ×d with the half vector for ẑ
    normal = np.cross(incident, outgoing)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    apart = length > _NORMAL
    return np.where(apart, normal / np.where(apart, length, 1.0), fallback)


def turn(to: Real, start: Real, direction: Real) -> Complex:
    """Matrix (..., 2, 2) from components along (start, d×start) to those along (to, d×to)."""
    cosine = np.sum(to * start, axis=-1)
    sine = np.sum(to * np.cross(direction, start), axis=-1)
    return jones_matrix(ss=cosine, sp=sine, ps=-sine, pp=cosine)


def jones_matrix(*, ss: ArrayLike, sp: ArrayLike, ps: ArrayLike, pp: ArrayLike) -> Complex:
    """[[ss, sp], [ps, pp]]; the first letter is the outgoing polarisation."""
    entries = np.broadcast_arrays(*(np.asarray(x, np.complex128) for x in (ss, sp, ps, pp)))
    return np.stack(entries, axis=-1).reshape(*entries[0].shape, 2, 2)
