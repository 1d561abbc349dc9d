"""The second order of the small-slope approximation, as a factor on the first (NumPy, float64).

Voronovich 1994 (Waves in Random Media 4, 337): with B and B₂ the first two orders of perturbation,
R = −2i q0 B ĥ + q0 Σ_u B₂ ĥ ĥ, ĥ and a the spectra of the heights and of exp(−iQh), Q = q + q0, and
ξ the frequency that the surface adds to a wave (evanescent waves included),

    R(k) = 2 q0/Q · [B a(k−k0) + i/4 Σ_ξ M ĥ(ξ) a(k−k0−ξ)],   M = B₂(k−ξ) + B₂(k0+ξ) + 2QB.

M is 0 where ξ is 0 or k−k0. Where waves in between travel it is smooth, and close to
C_l ξ_l (k−k0−ξ)_l + C_t ξ_t (k−k0−ξ)_t, with l along k−k0 and t across. As ξ ĥ is the spectrum of
−i∇h, and (k−k0−ξ) a that of −Q ∇h exp(−iQh), the sum is then −Q/4 · (C_l D_l + C_t D_t), D_l the
spectrum of (∂_l h)² exp(−iQh). For unpolarised light the power of the first order is multiplied by

    |1 + s (c_l r_l + c_t r_t)|²,   c = −Q/4 Σ B* C / Σ |B|²,   r = a* D / |a|²,

with s the weight of small slope in the model (`blend.small_slope_weight`), eq. (10) of
docs/theory.md.

- c depends on the directions and the index alone. It is symmetric in ωi and ωo, and even in the
  azimuth between them.
- r depends on the heights alone (`slope_ratios`).
- The form is for dielectrics: on metals surface plasmons are a pole of M, which it cannot have.
- Towards the normal the second order is small and the form's error exceeds it. There c is
  attenuated by `obliqueness`, chosen by rigorous solutions (docs/validation.md).

Lengths are over 2π/λ.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from .arithmetic import Number, formula, of
from .fresnel import decaying_root

#: Real and imaginary part of two complex numbers, of a coefficient along and one across.
Parts = tuple[Number, Number, Number, Number]
Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

#: Largest amplitude that the second order adds, relative to the first: powers grow to 2.25 at most.
LIMIT = 0.5
#: Frequency F of the slopes' filter 1/(1 + (ξ/F)²): that of light at grazing angles.
CUTOFF = 2.0
#: Nodes of `coefficient_table` along θi, θo and the azimuth.
NODES = 17

# M is sampled on circles about (k−k0)/2, up to three times the width, where waves travel
_WIDTH, _RADII, _AZIMUTHS = 0.55, 8, 6
# Added to |ξ||k−k0−ξ| in the weight 1/(|ξ||k−k0−ξ|), which is infinite where either is 0
_LEVEL = 0.02
# Regularisation in units of the equations' trace: at k = k0 l and t are equivalent
_RIDGE = 1e-6
_NO_CONTRAST = 1e-4
# Last node, rad: at 90° c is 0/0
_HORIZON = np.radians(89.9)


def axes(vector: Complex, index: complex) -> Complex:
    """Electric fields s and p of plane waves κ (..., 3) in a medium, (2, ..., 3).

    s = ẑ×κ̂, p = κ̂×s.
    """
    x, y = vector[..., 0].real, vector[..., 1].real
    length = np.hypot(x, y)
    slanted = length > 1e-12
    safe = np.where(slanted, length, 1.0)
    sine, cosine = np.where(slanted, -y / safe, 0.0), np.where(slanted, x / safe, 1.0)
    fields = np.zeros((2, *vector.shape), complex)
    fields[0, ..., 0], fields[0, ..., 1] = sine, cosine
    z = vector[..., 2] / index
    fields[1, ..., 0], fields[1, ..., 1] = -z * cosine, z * sine
    fields[1, ..., 2] = (x * cosine - y * sine) / index
    return fields


class Perturbation:
    """B and B₂ of light from one direction, between `axes`.

    They solve ∫ (E×H' − E'×H)·n dS = 0, order by order, for waves above the surface and test waves
    that go down in the material (Brown, Celli, Haller and Marvin 1984, Surface Science 136, 381).
    For plane waves the integrand is (κ+κ')·(e×(κ'×e') − e'×(κ×e)) = (n² − 1) e·e', since their
    fields are transverse.

    Parameters
    ----------
    wi : (3,) unit vector to the light.
    index : n + ik of the material relative to the medium above it.
    """

    def __init__(self, wi: ArrayLike, index: complex) -> None:
        incident = np.asarray(wi, np.float64)
        k0 = -incident[:2]
        self._index, self._q0 = complex(index), float(incident[2])
        self._up = _wave(k0, 1.0)
        self._came = self._up * [1, 1, -1]
        lit, gamma = self._against(k0, self._came)
        self._flat = -self._inverse(k0) @ (lit / gamma)

    def first(self, k: Real) -> Complex:
        """B (..., 2, 2) of light that leaves along k (..., 2)."""
        return np.asarray(0.5j / self._q0 * self._once(k))

    def second(self, k: Real, u: Real) -> Complex:
        """B₂ (..., 2, 2) by way of waves of tangential part u; k and u (..., 2) broadcast."""
        (lit, gamma), (back, gamma_back) = self._driving(k)
        level = -0.5 * (gamma * lit + gamma_back * back)
        between, _ = self._against(k, _wave(u, 1.0))
        return np.asarray(-self._inverse(k) @ (1j * between @ self._once(u) + level) / self._q0)

    def _once(self, k: Real) -> Complex:
        (lit, _), (back, _) = self._driving(k)
        return np.asarray(-1j * self._inverse(k) @ (lit + back))

    def _driving(self, k: Real) -> list[tuple[Complex, Complex]]:
        """Fluxes into waves along k of the incident light and of its flat reflection, and γ."""
        (lit, gamma), (back, gamma_back) = (self._against(k, w) for w in (self._came, self._up))
        return [(lit, gamma), (back @ self._flat, gamma_back)]

    def _inverse(self, k: Real) -> Complex:
        flux, gamma = self._against(k, _wave(k, 1.0))
        return np.asarray(gamma * np.linalg.inv(flux))

    def _against(self, k: Real, wave: Complex) -> tuple[Complex, Complex]:
        """Flux of waves against test waves −k that go down in the material, and γ = κ_z + κ'_z."""
        to = _wave(k, self._index) * [-1, -1, -1]
        tests, fields = axes(to, self._index), axes(wave, 1.0)
        products = [np.einsum("...i,...i", test, e) for test in tests for e in fields]
        stacked = np.stack(products, axis=-1)
        flux = (self._index**2 - 1.0) * stacked.reshape(*stacked.shape[:-1], 2, 2)
        return flux, (wave + to)[..., 2, None, None]


def _wave(tangential: Real, index: complex) -> Complex:
    """Wave vectors (..., 3) that go up in a medium, or decay."""
    normal = np.asarray(decaying_root(index**2 - np.sum(tangential**2, axis=-1) + 0j))
    return np.concatenate([tangential, normal[..., None]], axis=-1)


def slope_coefficients(wi: ArrayLike, wo: ArrayLike, index: complex) -> Complex:
    """c_l and c_t, (n, 2): fit of M by products of slopes over the waves that travel.

    Parameters
    ----------
    wi : (3,) unit vector to the light; wo : (n, 3) unit vectors of light that leaves.
    index : of a dielectric, relative to the medium above it.
    """
    incident, outgoing = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    if abs(index - 1.0) < _NO_CONTRAST:  # nothing is reflected, by any order
        return np.zeros((len(outgoing), 2), complex)
    perturbation, k = Perturbation(incident, index), outgoing[:, None, :2]
    q = incident[:2] + k
    length = np.hypot(q[..., 0], q[..., 1])
    along = np.where(length[..., None] > 1e-6, q / np.maximum(length, 1e-12)[..., None], [1.0, 0.0])
    radius = 3.0 * _WIDTH * np.repeat((np.arange(_RADII) + 0.5) / _RADII, _AZIMUTHS)
    turn = np.tile(np.pi * (np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS, _RADII)
    z = radius * np.stack([np.cos(turn), np.sin(turn)])
    across = along[..., ::-1] * [-1.0, 1.0]
    offset = z[0][:, None] * along + z[1][:, None] * across
    first, between = perturbation.first(outgoing[:, :2]), 0.5 * q + offset
    kappa = (incident[2] + outgoing[:, 2])[:, None, None, None]
    kernel = perturbation.second(k, k - between) + perturbation.second(k, between - incident[:2])
    kernel = kernel + 2.0 * kappa * first[:, None]
    squares = [(0.5 * length + sign * z[0]) ** 2 + z[1] ** 2 for sign in (1.0, -1.0)]
    weight = (
        radius * np.exp(-((radius / _WIDTH) ** 2)) / (np.sqrt(squares[0] * squares[1]) + _LEVEL)
    )
    filtered = (1.0 + squares[0] / CUTOFF**2) * (1.0 + squares[1] / CUTOFF**2)
    products = np.stack([0.25 * length**2 - z[0] ** 2, 0.0 * length - z[1] ** 2], axis=-1)
    products /= filtered[..., None]
    matrix = np.einsum("nm,nmi,nmj->nij", weight, products, products)
    trace = np.trace(matrix, axis1=1, axis2=2)[:, None, None]
    onto = np.einsum("nmab,nab->nm", kernel, first.conj())
    right = np.einsum("nm,nmi,nm->ni", weight, products, onto)
    fit = np.linalg.solve(matrix + _RIDGE * trace * np.eye(2), right[..., None])[..., 0]
    power = np.sum(np.abs(first) ** 2, axis=(1, 2))
    oblique = obliqueness(incident[2], outgoing[:, 2])[:, None]
    return np.asarray(-0.25 * oblique * kappa[:, 0, 0] * fit / power[:, None])


def obliqueness(cos_i: ArrayLike, cos_o: ArrayLike) -> Real:
    """Factor on c: 0 along the normal, 1 where both directions are beyond 45°."""
    mean = 0.5 * (np.asarray(cos_i, np.float64) + np.asarray(cos_o, np.float64))
    return np.asarray(np.minimum(1.0, 2.0 * (1.0 - mean**2)))


@lru_cache(maxsize=16)
def coefficient_table(index: float) -> Complex:
    """c at nodes (θi, θo, azimuth of ωo from that of −ωi, 2), evenly from 0 to π/2, π/2 and π.

    There are `NODES` along each axis; c is symmetric in the first two. It costs half a second.
    """
    polar = np.clip(np.linspace(0.0, 0.5 * np.pi, NODES), 1e-3, _HORIZON)
    azimuth = np.linspace(0.0, np.pi, NODES)
    table = np.empty((NODES, NODES, NODES, 2), complex)
    for n, theta in enumerate(polar):
        out, turn = np.meshgrid(polar[n:], azimuth, indexing="ij")
        wi = np.array([-np.sin(theta), 0.0, np.cos(theta)])
        wo = np.stack([np.sin(out) * np.cos(turn), np.sin(out) * np.sin(turn), np.cos(out)], -1)
        rows = slope_coefficients(wi, wo.reshape(-1, 3), index).reshape(*out.shape, 2)
        table[n, n:] = table[n:, n] = rows
    table.setflags(write=False)
    return table


def interpolated(index: float, wi: ArrayLike, wo: ArrayLike) -> Complex:
    """Interpolate `coefficient_table` linearly at wi and wo, (n, 3)."""
    incident, outgoing = np.broadcast_arrays(*(np.asarray(w, np.float64) for w in (wi, wo)))
    nodes = np.linspace(0.0, 0.5 * np.pi, NODES)
    angles = [np.arccos(np.clip(w[..., 2], 0.0, 1.0)) for w in (incident, outgoing)]
    turn = np.arctan2(outgoing[..., 1], outgoing[..., 0])
    turn = turn - np.arctan2(-incident[..., 1], -incident[..., 0])
    angles.append(np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi))
    table = scipy.interpolate.RegularGridInterpolator(
        (nodes, nodes, 2.0 * nodes), coefficient_table(index)
    )
    return np.asarray(table(np.stack(angles, axis=-1)))


def factor(coefficients: ArrayLike, ratios: ArrayLike, small_slope_weight: ArrayLike) -> Real:
    """|1 + s (c_l r_l + c_t r_t)|², (...), the factor on the power of unpolarised light.

    Parameters
    ----------
    coefficients, ratios : c and r, (..., 2).
    small_slope_weight : s, (...).
    """
    c, r = np.asarray(coefficients), np.asarray(ratios)
    parts = [(x.real, x.imag) for pair in (c, r) for x in (pair[..., 0], pair[..., 1])]
    change = added_power((*parts[0], *parts[1]), (*parts[2], *parts[3]), small_slope_weight)
    return np.asarray(1.0 + change)


@formula
def added_power(c: Parts, r: Parts, weight: Number) -> Number:
    """Return |1 + weight (c_l r_l + c_t r_t)|² − 1, with the added term limited to `LIMIT`.

    Parameters
    ----------
    c, r : real and imaginary parts of the two coefficients, and of the two ratios.
    weight : s, with whatever multiplies r.
    """
    real = weight * (c[0] * r[0] - c[1] * r[1] + c[2] * r[2] - c[3] * r[3])
    imaginary = weight * (c[0] * r[1] + c[1] * r[0] + c[2] * r[3] + c[3] * r[2])
    xp = of(real)
    square = xp.fma(real, real, imaginary * imaginary)
    length = xp.sqrt(xp.maximum(square, 1e-20))
    clipped = xp.minimum(1.0, LIMIT * xp.reciprocal(length))
    return clipped * xp.fma(clipped, square, 2.0 * real)
