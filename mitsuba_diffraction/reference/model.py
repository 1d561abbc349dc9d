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
window has the light's σ₀; a small scan, which is seen through windows (scan.py), limits σ of other
orders alone. C makes up for the part of its lobe beyond the horizon, and J_0 has r_s and r_p at θm,
whose mean over the lobe is that of ωi (mirror.py). K is Kirchhoff's tangent plane: Fresnel's r_s,
r_p at the half vector; U turns between the facet's axes and s = ẑ×d/|ẑ×d|, p = d×s of light along
d. Rows and columns of J are s and p of the outgoing and the incoming light. B is first-order small
slope (Rice 1951; Voronovich 1985). Indices and results are arrays (n,) as in `Light`. coat.py and
transmission.py wrap this.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..heights.field import HeightField
from ..optics.blend import ScaleRoughness
from ..optics.fresnel import Index
from . import boundary, scan
from .boundary import facet_axis, jones_matrix, mixed, polarisation_axes, turn, unpolarised
from .fresnel import amplitudes, decaying_root
from .mirror import horizon_correction, mirror_cosine

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Light(NamedTuple):
    """Directions ωi and ωo (n, 3), and wavelengths (n,) in nm, in the medium above the surface."""

    wi: Real
    wo: Real
    wavelength: Real


class Sigmas(NamedTuple):
    """σ under which all orders but 0 are summed, and σ₀ of order 0's, the light's; both in µm.

    `windows`: a scan's, which does not tile the plane.
    """

    orders: float
    zeroth: float
    windows: scan.ScanWindows | None = None


def default_brdf(
    field: HeightField,
    light: Light,
    index: Complex,
    sigmas: Sigmas,
    measure: Callable[[Complex], Real] = unpolarised,
) -> Real:
    """BRDF of the default model, 1/sr; `measure` is N of (5), or a Mueller matrix in its place."""
    jones = mixed(kirchhoff(light, index), small_slope(light, index), share(field, light, index))
    others, zeroth = ensemble_power(field, light, sigmas)
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
    jones = facets(light, index, mirror_cosine(light, sigmas.zeroth))[0]
    return (factor * measure(jones).T).T


def ensemble_power(field: HeightField, light: Light, sigmas: Sigmas) -> Real:
    """Σ_j≠0 ⟨|P_j|²⟩ and ⟨|P_0|²⟩ of (3) in µm⁴, (2, n)."""
    k, powers = 2e3 * np.pi / light.wavelength, np.zeros((2, len(light.wavelength)))
    parts, tapers = scan.parts(field, sigmas.windows), scan.tapers(field, sigmas.windows)
    for n, (u, v, w) in enumerate(light.wi + light.wo):
        q, kappa = (k[n] * u, k[n] * v), k[n] * w  # (1): frequency q, and phase per height κ
        screens = (np.exp(1j * kappa * part) for part in parts)
        orders = (orders_near(q, sigmas.orders, s, field.pixel_size, tapers) for s in screens)
        powers[:, n] = np.mean([window_sums(each, q, sigmas) for each in orders], axis=0)
    return np.maximum(powers, 0.0)  # sharpened powers of a scan dip below 0 between strong orders


class Orders(NamedTuple):
    """Orders about q: q_j along x and y, plane waves exp(i q_j·r) at the pixels, and a_j (y, x).

    `tapers`: of a scan's windows.
    """

    qx: Real
    qy: Real
    waves_x: Complex
    waves_y: Complex
    a: Complex
    tapers: scan.Tapers | None = None


def orders_near(
    q: tuple[float, float], sigma: float, screen: Complex, pixel_size: tuple[float, float],
    tapers: scan.Tapers | None = None,
) -> Orders:  # fmt: skip
    """Orders (2) of a screen (ny, nx), or of a faded one, that the window about q reaches."""
    (ny, nx), (screen, mean) = screen.shape, scan.faded(screen, tapers)
    qx, waves_x = plane_waves(screen.shape[1], pixel_size[0], q[0], sigma)
    qy, waves_y = plane_waves(screen.shape[0], pixel_size[1], q[1], sigma)
    a = waves_y @ screen @ waves_x.T / screen.size
    if mean is not None:
        a[np.ix_(qy == 0, qx == 0)] = mean
    return Orders(qx, qy, waves_x[:, :nx], waves_y[:, :ny], a, tapers)


def plane_waves(n: int, pixel: float, q: float, sigma: float) -> tuple[Real, Complex]:
    """Frequencies q_j of a DFT of n pixels near q, and exp(i q_j x) at the pixels."""
    # exp(−8.6²/2) = 9e-17: amplitudes farther from q are below the last bit of the sum
    spacing, reach = 2 * np.pi / (n * pixel), 8.6 / sigma
    first, last = np.ceil((q - reach) / spacing), np.floor((q + reach) / spacing)
    # A DFT of an even number of points has −n/2 but not +n/2
    j = np.arange(max(first, -(n // 2)), min(last, (n - 1) // 2) + 1)
    turns = np.outer(j, np.arange(n)) % n  # exact integers keep the phase exact
    return j * spacing, np.exp(2j * np.pi / n * turns)


def window_sums(orders: Orders, q: tuple[float, float], sigmas: Sigmas) -> tuple[float, float]:
    """Σ_j≠0 ⟨|P_j|²⟩ and ⟨|P_0|²⟩ of (3)."""
    sigma, ratio = sigmas.orders, (sigmas.zeroth / sigmas.orders) ** 2
    window_x, window_y = (np.exp(-((sigma * d) ** 2)) for d in (q[0] - orders.qx, q[1] - orders.qy))
    powers, mirror = np.abs(orders.a) ** 2, np.ix_(orders.qy == 0, orders.qx == 0)
    zeroth, powers[mirror] = powers[mirror].sum(), 0.0
    if orders.tapers is not None:
        powers = scan.sharpened(powers, (orders.qy == 0, orders.qx == 0), orders.tapers)
    lobe, unit = np.exp(-(sigmas.zeroth**2) * (q[0] ** 2 + q[1] ** 2)), 4 * np.pi**2 * sigma**4
    return float(unit * (window_y @ powers @ window_x)), float(unit * ratio * lobe * zeroth)


def share(field: HeightField, light: Light, index: Index) -> Real:
    """s of (9), the part of small slope in J."""
    total, k = light.wi + light.wo, 2e3 * np.pi / light.wavelength
    q = k * np.hypot(total[:, 0], total[:, 1])
    variance = ScaleRoughness.from_heights(field.heights, field.pixel_size).at(q)
    return boundary.small_slope_weight(k * total[:, 2], variance, index)


def kirchhoff(light: Light, index: Complex) -> Complex:
    """K of (7), (n, 2, 2)."""
    jones, one_plus_dot = facets(light, index)
    return (one_plus_dot / (2 * light.wi[:, 2] * light.wo[:, 2]))[:, None, None] * jones


def facets(light: Light, index: Index, cosine: Real | None = None) -> tuple[Complex, Real]:
    """U(ωo) diag(r_s, r_p) U(ωi), (n, 2, 2), and 1 + ωi·ωo; r at the half vector or a cosine."""
    half = light.wi + light.wo
    # |ωi + ωo|²/2 = 1 + ωi·ωo, and cosθ at the half vector is √((1 + ωi·ωo)/2)
    one_plus_dot = 0.5 * np.sum(half * half, axis=1)
    if cosine is None:
        cosine = np.sqrt(np.minimum(0.5 * one_plus_dot, 1.0))
    return facets_of(light, *amplitudes(cosine, index)), one_plus_dot


def facets_of(light: Light, r_s: Complex, r_p: Complex) -> Complex:
    """U(ωo) diag(r_s, r_p) U(ωi), (n, 2, 2)."""
    wi, wo, _ = light
    s_in, s_out = polarisation_axes(wi, wo)
    axis = facet_axis(wi, wo, s_in)
    facet = jones_matrix(ss=r_s, sp=0.0, ps=0.0, pp=r_p)
    return turn(s_out, axis, wo) @ facet @ turn(axis, s_in, -wi)


def small_slope(light: Light, index: Complex) -> Complex:
    """B of (8), (n, 2, 2); t0 and t are the tangential parts of −ωi and ωo (no unit)."""
    wi, wo, _ = light
    (x0, y0, _), (x, y, _) = (axis.T for axis in polarisation_axes(wi, wo))
    dot, cross = x0 * x + y0 * y, x0 * y - y0 * x  # t̂·t̂0 and ẑ·(t̂0×t̂)
    t0, t, epsilon = np.hypot(wi[:, 0], wi[:, 1]), np.hypot(wo[:, 0], wo[:, 1]), index * index
    inside0, inside = decaying_root(epsilon - t0**2), decaying_root(epsilon - t**2)
    over_s0, over_s = 1 / (wi[:, 2] + inside0), 1 / (wo[:, 2] + inside)
    over_p0, over_p = 1 / (epsilon * wi[:, 2] + inside0), 1 / (epsilon * wo[:, 2] + inside)
    entries = jones_matrix(
        ss=-over_s * over_s0 * dot,
        sp=over_s * (inside0 * over_p0) * cross,
        ps=(inside * over_p) * over_s0 * cross,
        pp=(inside * over_p) * (inside0 * over_p0) * dot - epsilon * over_p * over_p0 * t * t0,
    )
    return entries * (epsilon - 1)[:, None, None]
