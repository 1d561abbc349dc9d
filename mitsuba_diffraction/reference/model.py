"""The default model in one file: light that a rough surface reflects (NumPy, float64).

A surface of heights h(r) tiles the plane. Light of wavelength λ arrives from ωi and leaves along
ωo, unit vectors that point away from the surface; n is the material's complex index relative to the
medium above it. Lengths are in µm. The equations have the numbers of docs/theory.md:

    (u, v, w) = ωi + ωo,   k = 2π/λ,   q = k (u, v),   κ = k w                                  (1)
    a_j(κ) = mean of exp(iκh) exp(i q_j·r) over the pixels                                      (2)
    ⟨|P_j|²⟩ = 4π²σ² |a_j|² σ_j² exp(−σ_j²|q − q_j|²),   σ_j = σ for j ≠ 0                      (3)
    f = 4 cosθi cosθo N / (λ² A w²) · Σ_j≠0 ⟨|P_j|²⟩ + f_0,   A = πσ²                           (4)
    N = ½ Σ |J|² over the four entries of J                                                     (5)
    J = (1 − s) K + s B                                                                         (6)
    K = (1 + ωi·ωo) / (2 cosθi cosθo) · U(ωo) diag(r_s, r_p) U(ωi)                              (7)
    B = (ε − 1) · [the four entries in `small_slope`],   ε = n²                                 (8)
    s = exp(−R₀(κσ_q)²/2 − (κσ_q)⁴/3),   R₀ = |(n − 1)/(n + 1)|²                                (9)
    σ_q² = Σ_q' |h_q'|² (1 − exp(−(4q'/q)⁴)) exp(−(q'/2q)⁴),   h_q' the heights' spectrum
    f_0 = N_0 C(X_i) C(X_o) / (λ² A) · ⟨|P_0|²⟩,   N_0 of J_0 = U(ωo) diag(r_s, r_p) U(ωi)     (10)
    C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) C(Y) = 1,   X = √(kσ₀) cosθ                           (11)
    cosθm = cosθh − (h(X_i) + h(X_o))/√(kσ₀)                                                   (12)

(2) are the orders of the phase screen exp(iκh), q_j = 2π (j_x/W_x, j_y/W_y) with W the patch's
size. P in (3) is the transform of the window exp(−r²/2σ²) times the screen; its power is averaged
over positions of the window (Stam 1999, eq. 7–12). Any patch knows order 0, the mirror, whose
window has the light's σ₀; a small scan, which is seen through windows, limits σ of other orders
alone (screens.py). C makes up for the part of its lobe beyond the horizon, and J_0 has r_s and r_p
at θm, whose mean over the lobe is that of ωi (mirror.py). K is Kirchhoff's tangent plane: Fresnel's
r_s, r_p at the half vector; U turns between the facet's axes and s = ẑ×d/|ẑ×d|, p = d×s of light
along d. Rows and columns of J are s and p of the outgoing and the incoming light. B is first-order
small slope (Rice 1951; Voronovich 1985). Indices and results are arrays (n,) as in `Light`. coat.py
and transmission.py wrap this.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Complex, Real
from ..heights import HeightField
from ..optics.blend import ScaleRoughness
from ..optics.fresnel import Filmed, Index
from .boundary import facet_axis, jones_matrix, polarisation_axes, turn, unpolarised
from .fresnel import amplitudes, faces, reflectance
from .mirror import horizon_correction, mirror_cosine
from .screens import Orders, Sigmas, Sums, patch_power, sharpened


class Light(NamedTuple):
    """Directions ωi and ωo (n, 3), and wavelengths (n,) in nm, in the medium above the surface."""

    wi: Real
    wo: Real
    wavelength: Real


def default_brdf(
    field: HeightField,
    light: Light,
    index: Complex,
    sigmas: Sigmas,
    measure: Callable[[Complex], Real] = unpolarised,
) -> Real:
    """BRDF of the default model, 1/sr; `measure` is N of (5), or a Mueller matrix in its place."""
    jones = blended(light.wi, light.wo, index, share(field, light, index))
    others, zeroth, _ = ensemble_power(field, light, sigmas)
    rest = reflected(light, sigmas.orders, others, jones, measure)
    return rest + mirrored(light, sigmas, zeroth, index, measure)


def reflected(
    light: Light, sigma: float, power: Real, jones: Complex, measure: Callable[[Complex], Real]
) -> Real:
    """f of (4) without f_0, from Σ_j≠0 ⟨|P_j|²⟩ and J."""
    (cos_i, cos_o), lam = (light.wi[:, 2], light.wo[:, 2]), light.wavelength * 1e-3
    factor = 4 * cos_i * cos_o / (lam**2 * np.pi * sigma**2 * (cos_i + cos_o) ** 2)
    return (factor * power * measure(jones).T).T


def mirrored(
    light: Light, sigmas: Sigmas, power: Real, index: Index, measure: Callable[[Complex], Real]
) -> Real:
    """f_0 of (10) from ⟨|P_0|²⟩."""
    visible = horizon_correction(light, sigmas.zeroth)
    factor = visible * power / ((light.wavelength * 1e-3) ** 2 * np.pi * sigmas.orders**2)
    r = amplitudes(mirror_cosine(light, sigmas.zeroth), index)
    return (factor * measure(facets(light.wi, light.wo, *r)).T).T


def window_sums(
    orders: Orders, q: tuple[float, float], sigmas: Sigmas
) -> tuple[float, float, float]:
    """`Sums` of (3), the mean over positions of the window, where no orders interfere."""
    sigma, ratio = sigmas.orders, (sigmas.zeroth / sigmas.orders) ** 2
    window_x, window_y = (np.exp(-((sigma * d) ** 2)) for d in (q[0] - orders.qx, q[1] - orders.qy))
    powers, mirror = np.abs(orders.a) ** 2, (orders.qy == 0, orders.qx == 0)
    powers[np.ix_(*mirror)] = 0.0
    if orders.tapers is not None:
        powers = sharpened(powers, mirror, orders.tapers)
    lobe, unit = np.exp(-(sigmas.zeroth**2) * (q[0] ** 2 + q[1] ** 2)), 4 * np.pi**2 * sigma**4
    zeroth = ratio * lobe * abs(orders.zeroth) ** 2 * np.any(np.outer(*mirror))  # within reach
    return float(unit * (window_y @ powers @ window_x)), float(unit * zeroth), 0.0


def ensemble_power(
    field: HeightField, light: Light, sigmas: Sigmas, sums: Sums = window_sums
) -> Real:
    """`sums` for each pair of directions, (3, n)."""
    total = (2e3 * np.pi / light.wavelength)[:, None] * (light.wi + light.wo)  # (1): q, κ
    powers = [patch_power(field, kappa, (x, y), sigmas, sums) for x, y, kappa in total]
    return np.reshape(powers, (-1, 3)).T


def share(field: HeightField, light: Light, index: Index) -> Real:
    """s of (9), the part of small slope in J."""
    total, k = light.wi + light.wo, 2e3 * np.pi / light.wavelength
    q = k * np.hypot(total[:, 0], total[:, 1])
    variance = ScaleRoughness.from_heights(field.heights, field.pixel_size).at(q)
    return small_slope_weight(k * total[:, 2], variance, index)


def small_slope_weight(kappa: ArrayLike, variance: ArrayLike, index: Index) -> Real:
    """s of (9) for κ (rad/µm) and σ_q² (µm²), any shapes that broadcast; a film counts in R₀."""
    roughness = np.square(np.asarray(kappa, np.float64)) * np.asarray(variance, np.float64)
    return np.exp(-roughness * (0.5 * reflectance(1.0, index) + roughness / 3))


def blended(wi: ArrayLike, wo: ArrayLike, index: Index, s: ArrayLike) -> Complex:
    """J of (6), (..., 2, 2); s (...), other arguments as for `small_slope`."""
    weight = np.asarray(s, np.float64)[..., None, None]
    k, b = kirchhoff(wi, wo, index), small_slope(wi, wo, index)
    return np.asarray((1 - weight) * k + weight * b)


def kirchhoff(wi: ArrayLike, wo: ArrayLike, index: Index) -> Complex:
    """K of (7), (..., 2, 2); arguments as for `small_slope`.

    Its N is R(cosθ_half) (1 + ωi·ωo)² / (2 cosθi cosθo)² (Stam 1999, eq. 7).
    """
    wi, wo = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    half = wi + wo
    # |ωi + ωo|²/2 = 1 + ωi·ωo is the form that survives opposite grazing directions
    one_plus_dot = 0.5 * np.sum(half * half, axis=-1)
    cosine = np.sqrt(np.minimum(0.5 * one_plus_dot, 1.0))
    if isinstance(index, Filmed):
        index = index.tilted(0.5 * half[..., 2] / cosine)
    scale = one_plus_dot / (2 * wi[..., 2] * wo[..., 2])
    return np.asarray(scale[..., None, None] * facets(wi, wo, *amplitudes(cosine, index)))


def facets(wi: Real, wo: Real, r_s: Complex, r_p: Complex) -> Complex:
    """U(ωo) diag(r_s, r_p) U(ωi), (..., 2, 2)."""
    s_in, s_out = polarisation_axes(wi, wo)
    axis = facet_axis(wi, wo, s_in)
    facet = jones_matrix(ss=r_s, sp=0.0, ps=0.0, pp=r_p)
    return turn(s_out, axis, wo) @ facet @ turn(axis, s_in, -wi)


def small_slope(wi: ArrayLike, wo: ArrayLike, index: Index) -> Complex:
    """B of (8), (..., 2, 2): products of the fields that light makes along −ωi and back along ωo.

    At a bare interface fields are s = 1/(cosθ + q'), p = 1/(ε cosθ + q') and x = q' p with
    q' = √(ε − sin²θ) (`fresnel.faces`); both interfaces of a film add up.

    Parameters
    ----------
    wi, wo : (..., 3) unit vectors above the surface, pointing away from it.
    index : (...) n + ik of the material relative to the medium above it, finite, k ≥ 0; or
        the index under a film, `optics.fresnel.Filmed`.
    """
    wi, wo = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    (x0, y0, _), (x, y, _) = (np.moveaxis(axis, -1, 0) for axis in polarisation_axes(wi, wo))
    dot, cross = x0 * x + y0 * y, x0 * y - y0 * x  # t̂·t̂0 and ẑ·(t̂0×t̂)
    sine0, sine = (np.hypot(w[..., 0], w[..., 1]) for w in (wi, wo))
    ends = faces(wi[..., 2], sine0**2, index), faces(wo[..., 2], sine**2, index)
    matrices = [
        at.contrast[..., None, None]  # ε − 1
        * jones_matrix(
            ss=-to.s * at.s * dot,
            sp=to.s * at.x * cross,
            ps=to.x * at.s * cross,
            pp=to.x * at.x * dot - at.normal * to.p * at.p * sine * sine0,
        )
        for at, to in zip(*ends, strict=True)
    ]
    return np.asarray(sum(matrices[1:], matrices[0]))
