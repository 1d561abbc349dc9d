"""Directions to diffraction coordinates, the factors outside the integral, and shadowing."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from ..errors import DiffractionError
from .arithmetic import Number, of

#: A window of `coherence_width` spans four standard deviations of its amplitude.
WIDTHS_PER_SIGMA = 4.0
#: Tables of directions end at this polar angle, rad.
LAST_ANGLE = math.radians(89.5)
# Smallest normal number of single precision
_SMALLEST = float(np.finfo(np.float32).tiny)


def sigma_of(coherence_width: float) -> float:
    """Standard deviation σ (µm) of the amplitude window g(r) = exp(−r²/2σ²)."""
    return coherence_width / WIDTHS_PER_SIGMA


def check_angles(theta: float, phi: float) -> None:
    """Refuse a light's direction that is not above the horizon.

    Raises a DiffractionError if an angle is out of range.

    Parameters
    ----------
    theta : degrees from the normal, 0 to below 90.
    phi : azimuth in degrees, −360 to 360.
    """
    if not 0.0 <= theta < 90.0:
        raise DiffractionError(
            f"theta={theta:g} must be at least 0 and below 90 degrees from the normal: the light "
            "has to be above the horizon"
        )
    if not -360.0 <= phi <= 360.0:
        raise DiffractionError(f"phi={phi:g} must be from -360 to 360 degrees")


def wavenumber(wavelength: ArrayLike) -> Real:
    """k = 2π/λ in rad/µm, for a vacuum wavelength in nm."""
    return np.asarray(2e3 * np.pi / np.asarray(wavelength, np.float64), np.float64)


def diffraction_coordinates(wi: ArrayLike, wo: ArrayLike) -> tuple[Real, Real, Real]:
    """(u, v, w) = ωi + ωo, each of shape (n,), for unit vectors of shape (n, 3).

    The spatial frequency that light of wavenumber k probes is k·(u, v), its phase per height k·w
    (Stam 1999, eq. 8 and 9, with both directions pointing away from the surface).
    """
    total = np.asarray(wi, np.float64) + np.asarray(wo, np.float64)
    return total[..., 0], total[..., 1], total[..., 2]


def kirchhoff_factor(wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike, sigma: float) -> Real:
    """f / (R ⟨|P|²⟩) = (1 + ωi·ωo)² / (λ² A w² cosθi cosθo) in 1/µm⁴, zero below the surface.

    λ in µm and A = πσ², the integral of the squared window: then a flat mirror's directional
    albedo is its reflectance (Kirchhoff's (1 + ωi·ωo)/w is the obliquity factor of Beckmann and
    Spizzichino 1963, section 5.3; its use for BRDFs is Stam 1999, eq. 7).

    Parameters
    ----------
    wi, wo : (n, 3) unit vectors in the shading frame, both pointing away from the surface.
    wavelength : (n,) or scalar, nm.
    sigma : µm.
    """
    incident, outgoing = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    cos_i, cos_o = incident[..., 2], outgoing[..., 2]
    above = (cos_i > 0) & (cos_o > 0)
    cos_i, cos_o = np.where(above, cos_i, 1.0), np.where(above, cos_o, 1.0)
    w = cos_i + cos_o
    # |ωi + ωo|² = 2(1 + ωi·ωo) is the form that survives opposite grazing directions
    u, v, _ = diffraction_coordinates(incident, outgoing)
    one_plus_dot = 0.5 * (u * u + v * v + w * w)
    lam = np.asarray(wavelength, np.float64) * 1e-3
    area = np.pi * sigma**2
    return np.where(above, one_plus_dot**2 / (lam**2 * area * w**2 * cos_i * cos_o), 0.0)


def vcavity(cos_i: Number, cos_o: Number, one_plus_dot: Number) -> Number:
    """Return the shadowing of long V-shaped grooves with level edges, in any arithmetic.

    It is min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h)).

    Torrance and Sparrow 1967 (the form is Blinn's, 1977; Stam 1999, appendix, uses it for
    diffraction). With ωi + ωo = |ωi + ωo| h and |ωi + ωo|² = 2(1 + ωi·ωo) =: 2·one_plus_dot,
    (n·h)/(ωo·h) = (cosθi + cosθo)/(1 + ωi·ωo). Symmetric in the two directions.
    """
    xp = of(cos_i, cos_o, one_plus_dot)
    edge = xp.maximum(one_plus_dot, _SMALLEST)
    return xp.minimum(1.0, 2.0 * (cos_i + cos_o) * xp.minimum(cos_i, cos_o) / edge)


def horizon_attenuation(cosine: Number) -> Number:
    """Return the factor on light near the horizon where a surface has a scale of energy.

    An albedo above 1 there rises as 1/cosθ, or faster (wide lobes), and tables of directions end.

    cosine : of the angle to the normal, above 0.
    """
    xp = of(cosine)
    near = xp.clip(cosine * (1.0 / math.cos(LAST_ANGLE)), 0.0, 1.0)
    return near * xp.sqrt(near)
