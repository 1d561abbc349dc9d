"""Jones matrices of light that goes through a dielectric boundary in any arithmetic.

With w = n cosθt − cosθi, lengths over 2π/λ and q = 2π/λ (ωi + n ωo) tangential, light that goes
from above into a dielectric of index n has the BTDF

    f = n² · 4 cosθi n cosθt N / (λ² A w²) · ⟨|P|²⟩,   ⟨|P|²⟩ at −q and κ = 2π w/λ,

with N the mean power of the Jones matrix as in `boundary`. Orders add up to a flat interface's
transmittance as κh → 0. f/n² is the same for reversed light.

As w → 0 the power of all orders but order 0 vanishes. In the lobe of order 0 N/w² has no bound,
although the heights do not decide how a flat interface transmits a lobe of some width. Order 0
therefore has what the mirror's lobe of `mirror` leaves, of both directions above the surface:

    f_0 = n² · 4πσ²/λ² · N_0 |a_0(κ)|² C(X_i) C(X_o) exp(−σ²q²),

with N_0 of `order_0`, the flat surface's transmittance at θm: N_0 and the reflectance there add up
to 1. In the middle of the lobe it equals 4 cosθi n cosθt N/w²; elsewhere it is finite.

- Small slope: first-order perturbation (Rice 1951; Voronovich 1985), from the fields that light
  along ωi and reversed light along ωo make at the flat interface, as in `boundary.small_slope`.
- Kirchhoff's tangent plane: Fresnel's coefficients at the facet that refracts ωi to ωo, whose
  normal is along ωi + n ωo. The limit of short waves agrees with Walter, Marschner, Li and Torrance
  2007 (eq. 21).

In the refracted direction both are w/(2 cosθi) times Fresnel's t_s and t_p. The axes are defined in
`boundary`.
"""

from __future__ import annotations

from collections.abc import Callable

from .arithmetic import Number, of
from .blend import kirchhoff_weight
from .boundary import Direction, Geometry, Heights, Jones, facets, mixed
from .coat import Powers, transmittances
from .fresnel import decaying_root, normal_reflectance


def small_slope(geometry: Geometry, n: Number, outside: Number) -> Jones:
    """Return 2 cosθi cosθt B of first order.

    With t0, t the tangential parts of −ωi and n ωo and γ0, γ, γ0', γ' the normal ones above and
    inside (γ beyond the critical angle is imaginary),

        B_ss = (ε−1) (t̂·t̂0)                     / ((γ+γ')(γ0+γ0'))
        B_pp = (ε−1) n (γ γ0' (t̂·t̂0) + |t||t0|)  / ((εγ+γ')(εγ0+γ0'))
        B_ps = (ε−1) n γ  ẑ·(t̂0×t̂)              / ((εγ+γ')(γ0+γ0'))    s in, p out
        B_sp = −(ε−1) γ0' ẑ·(t̂0×t̂)              / ((γ+γ')(εγ0+γ0'))    p in, s out

    Parameters
    ----------
    geometry : of ωi above the surface and ωo below it, in the dielectric.
    n : real, of the dielectric relative to the medium above it.
    outside : γ² above the surface of the light below it; complex where it may be negative
        (`outside_square`).
    """
    xp = of(n, geometry.cos_i)
    epsilon, q0, q_inside = n * n, geometry.cos_i, -(n * geometry.cos_o)
    q, q0_inside = decaying_root(outside), xp.sqrt(epsilon - geometry.square_i)
    contrast = (epsilon - 1.0) * -2.0 * geometry.cos_i * geometry.cos_o
    s0, p0 = xp.reciprocal(q0 + q0_inside), xp.reciprocal(epsilon * q0 + q0_inside)
    s = contrast * of(q).reciprocal(q + q_inside)
    p = contrast * n * of(q).reciprocal(epsilon * q + q_inside)
    dot, cross, sines = geometry.dot, geometry.cross, n * geometry.sines
    return (
        s * (s0 * dot),
        -(s * (q0_inside * p0 * cross)),
        q * p * (s0 * cross),
        p * p0 * (q * (q0_inside * dot) + sines),
    )


def outside_square(geometry: Geometry, n: Number) -> Number:
    """Return the squared cosine above the surface of the light below it, negative if reflected."""
    return 1.0 - n * n * geometry.square_o


def kirchhoff(geometry: Geometry, wi: Direction, wo: Direction, n: Number) -> Jones:
    """Return 2 cosθi cosθt K of the tangent plane; 0 where no facet refracts ωi to ωo."""
    x, y, z = (-(a + n * b) for a, b in zip(wi, wo, strict=True))
    xp = of(x, y, z)
    length = xp.sqrt(x * x + y * y + z * z)
    inverse = xp.reciprocal(xp.maximum(length, 1e-6))
    cos_in = (wi[0] * x + wi[1] * y + wi[2] * z) * inverse
    cos_out = -((wo[0] * x + wo[1] * y + wo[2] * z) * inverse)
    refracts = (cos_in > 0.0) & (cos_out > 0.0)
    cos_in = xp.where(refracts, cos_in, 1.0)
    scale = xp.where(refracts, 2.0 * cos_in * cos_out * length, 0.0)
    t_s = scale * xp.reciprocal(cos_in + n * cos_out)
    return facets(geometry, t_s, scale * xp.reciprocal(n * cos_in + cos_out))


def _blended(
    geometry: Geometry,
    wi: Direction,
    wo: Direction,
    n: Number,
    outside: Number,
    heights: Heights | None,
) -> Jones:
    """Return 2 cosθi cosθt J, blended as reflected light is (eq. 6 and 9)."""
    assert heights is not None
    weight = kirchhoff_weight(heights.kappa, heights.variance, normal_reflectance(n))
    return mixed(kirchhoff(geometry, wi, wo, n), small_slope(geometry, n, outside), weight)


Formula = Callable[[Geometry, Direction, Direction, Number, Number, Heights | None], Jones]
#: Formulas of `boundary.MODELS` for light that goes through, by name: 2 cosθi cosθt J of the
#: geometry, ωi above the surface, ωo in the dielectric, n, γ² of `small_slope`, and `Heights`.
MODELS: dict[str, Formula] = {
    "small_slope": _blended,
    "kirchhoff": lambda geometry, wi, wo, n, outside, heights: kirchhoff(geometry, wi, wo, n),
}


def order_0(geometry: Geometry, passed: Powers) -> Jones:
    """Return the matrix of order 0, whose mean power is that of both transmittances.

    It is diag(√T_s, √T_p) between two turns, each by half of the angle from one plane of incidence
    to the other.

    passed : `flat_transmittances` at θm (`mirror`).
    """
    xp = of(*passed)
    # beyond the critical angle the root's derivative would be infinite
    s, p = (xp.sqrt(xp.maximum(t, 1e-14)) for t in passed)
    both, more = 0.5 * (s + p), 0.5 * (s - p)
    turned = both * geometry.dot
    return turned + more, -(both * geometry.cross), both * geometry.cross, turned - more


def flat_transmittances(cosine: Number, n: Number, thin: bool) -> Powers:
    """Return transmittances of s and p light by the flat surface.

    Parameters
    ----------
    cosine : of the direction above the surface, or beyond the flat other side of a sheet.
    thin : whether light passes a sheet: T/(2 − T), the sum over its reflections to and fro.
    """
    s, p = transmittances(cosine, n)
    if not thin:
        return s, p
    reciprocal = of(s).reciprocal
    return s * reciprocal(2.0 - s), p * reciprocal(2.0 - p)


def returned(cosine: Number, n: Number) -> Number:
    """Return T² R/(1 − R²) of the flat side of a sheet, the mean of both polarisations.

    This share passes the structure, is mirrored to and fro, and goes back through the structure.
    """
    s, p = (t * (1.0 - t) * of(t).reciprocal(2.0 - t) for t in transmittances(cosine, n))
    return 0.5 * (s + p)


def out_of_sheet(jones: Jones, n: Number, above: Number, below: Number) -> Jones:
    """Return the matrix of light that leaves a thin sheet through its flat other side.

    The flat side transmits T. Light that goes to and fro between the sides, as between two flat
    mirrors of reflectances R, adds up to 1/(1 − R R) (Born and Wolf, section 7.6, without
    interference):

        J'_ab = √(T_a(ωo) / (1 − R_a(ωo) R_b(ωi))) J_ab.

    above, below : cosines of the directions outside of the sheet, on its two sides.
    """
    came, left = transmittances(above, n), transmittances(below, n)
    factors = [t * of(t).reciprocal(t + other - t * other) for t in left for other in came]
    return tuple(
        entry * of(factor).sqrt(factor) for entry, factor in zip(jones, factors, strict=True)
    )
