"""Jones matrices of light that goes through a boundary: the judge of `optics.through` (float64)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Complex, Real
from .boundary import facet_axis, jones_matrix, polarisation_axes, turn
from .fresnel import amplitudes, decaying_root


def small_slope(wi: ArrayLike, wo: ArrayLike, index: float) -> Complex:
    """Jones matrices of first order, (..., 2, 2).

    Parameters
    ----------
    wi : (..., 3) unit vectors above the surface; wo : unit vectors below it, in the dielectric.
    index : real, of the dielectric relative to the medium above it.
    """
    s_in, s_out = polarisation_axes(wi, wo)
    n = float(index)
    incident, outgoing = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    sine0 = np.hypot(incident[..., 0], incident[..., 1])
    sine = n * np.hypot(outgoing[..., 0], outgoing[..., 1])
    q0, q_inside = incident[..., 2], -n * outgoing[..., 2]
    q = decaying_root(np.asarray(1.0 - sine**2, np.complex128))
    q0_inside = np.sqrt(np.maximum(n * n - sine0**2, 0.0))
    dot = np.sum(s_in * s_out, axis=-1)
    cross = s_in[..., 0] * s_out[..., 1] - s_in[..., 1] * s_out[..., 0]
    s0, s = 1.0 / (q0 + q0_inside), 1.0 / (q + q_inside)
    p0, p = 1.0 / (n * n * q0 + q0_inside), n / (n * n * q + q_inside)
    matrix = jones_matrix(
        ss=s * s0 * dot,
        sp=-s * q0_inside * p0 * cross,
        ps=q * p * s0 * cross,
        pp=p * p0 * (q * q0_inside * dot + sine * sine0),
    )
    return np.asarray((n * n - 1.0) * matrix)


def kirchhoff(wi: ArrayLike, wo: ArrayLike, index: float) -> Complex:
    """Jones matrices of the tangent plane, (..., 2, 2); 0 where no facet refracts ωi to ωo."""
    incident, outgoing = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    n = float(index)
    s_in, s_out = polarisation_axes(incident, outgoing)
    total = -(incident + n * outgoing)
    length = np.linalg.norm(total, axis=-1, keepdims=True)
    normal = total / np.maximum(length, 1e-12) * np.sign(n - 1.0)
    cos_in = np.sum(incident * normal, axis=-1)
    cos_out = -np.sum(outgoing * normal, axis=-1)
    refracts = (cos_in > 0) & (cos_out > 0)
    cos_in = np.where(refracts, cos_in, 1.0)
    # The normal along −(ωi + n ωo): (ωi + n ωo)×ωi is along ωo×ωi, reversed for n > 1
    axis = facet_axis(outgoing, incident, s_in)
    scale = np.where(refracts, cos_out * cos_in * length[..., 0], 0.0)
    scale /= -incident[..., 2] * outgoing[..., 2]
    t_s, t_p = scale / (cos_in + n * cos_out), scale / (n * cos_in + cos_out)
    facet = jones_matrix(ss=t_s, sp=0.0, ps=0.0, pp=t_p)
    return np.asarray(turn(s_out, axis, outgoing) @ facet @ turn(axis, s_in, -incident))


def order_0(wi: ArrayLike, wo: ArrayLike, passed: ArrayLike) -> Complex:
    """Jones matrices of order 0, (..., 2, 2), whose mean power is that of both transmittances.

    They are diag(√T_s, √T_p) between two turns, each by half of the angle from one plane of
    incidence to the other.

    wi, wo : (..., 3) unit vectors above and below the surface.
    passed : (2, ...) `flat_transmittances` at the angle of the mirror's lobe.
    """
    s_in, s_out = polarisation_axes(wi, wo)
    dot = np.sum(s_in * s_out, axis=-1)
    cross = s_in[..., 0] * s_out[..., 1] - s_in[..., 1] * s_out[..., 0]
    half = 0.5 * np.arctan2(cross, dot)
    turned = jones_matrix(ss=np.cos(half), sp=-np.sin(half), ps=np.sin(half), pp=np.cos(half))
    s, p = np.sqrt(np.asarray(passed, np.float64))
    return np.asarray(turned @ jones_matrix(ss=s, sp=0.0, ps=0.0, pp=p) @ turned)


def flat_transmittances(cosine: ArrayLike, index: float, thin: bool) -> Real:
    """Transmittances of s and p light by the flat surface, (2, ...).

    Parameters
    ----------
    cosine : of the direction above the surface, or beyond the flat other side of a sheet.
    index : of the dielectric relative to the medium above it.
    thin : whether below is beyond the flat other side of a sheet (`out_of_sheet`).
    """
    back = np.minimum(np.abs(np.stack(amplitudes(cosine, index))) ** 2, 1.0)
    return np.asarray((1.0 - back) / (1.0 + back) if thin else 1.0 - back)


def out_of_sheet(jones: ArrayLike, wi: ArrayLike, wo: ArrayLike, index: float) -> Complex:
    """Jones matrices (..., 2, 2) of light that leaves a thin sheet through its flat other side.

    The flat side transmits T. Light that goes to and fro between the sides, as between two flat
    mirrors of reflectances R, adds up to 1/(1 − R R) (Born and Wolf, section 7.6, without
    interference):

        J'_ab = √(T_a(ωo) / (1 − R_a(ωo) R_b(ωi))) J_ab.

    wi, wo : outside of the sheet, above and below, (..., 3).
    """
    came, left = (
        np.abs(np.stack(amplitudes(np.abs(np.asarray(w)[..., 2]), index), axis=-1)) ** 2
        for w in (wi, wo)
    )
    both = left[..., :, None] * came[..., None, :]
    return np.asarray(np.sqrt((1.0 - left[..., :, None]) / (1.0 - both)) * np.asarray(jones))
