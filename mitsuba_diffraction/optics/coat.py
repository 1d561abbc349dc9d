"""A flat clear coat over a structure, too thick for its two faces to interfere, in any arithmetic.

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

from .arithmetic import Number, formula, of, squared
from .boundary import Direction, Geometry, Heights, Jones, geometry, power
from .fresnel import Index, amplitudes

#: Powers of both polarisations, s and p.
Powers = tuple[Number, Number]


@formula
def refracted(direction: Direction, n: Number) -> Direction:
    """Return a unit vector above the face as it is in the coat, of relative index n."""
    outside_x, outside_y, _ = direction
    x, y = outside_x / n, outside_y / n
    xp = of(x, y)
    # Grazing light would come to lie in the face where the coat is none
    return x, y, xp.sqrt(xp.maximum(1.0 - (x * x + y * y), 1e-12))


@formula
def transmittances(cosine: Number, n: Number) -> Powers:
    """Return T_s and T_p of a face for the cosine of the angle outside; equal both ways."""
    xp = of(cosine, n)
    inside = xp.sqrt(xp.maximum(cosine * cosine + (n * n - 1.0), 0.0))
    outside = 4.0 * cosine * inside
    over_s, over_p = xp.reciprocal(inside + cosine), xp.reciprocal(n * n * cosine + inside)
    return outside * (over_s * over_s), n * n * outside * (over_p * over_p)


@formula
def bounced(face: Powers, structure: Powers) -> Number:
    """Return G of light that bounces, from R of the face and ρ of the structure for both ways."""
    xp = of(*face, *structure)
    # At Brewster's angle R is 0 to rounding
    first, second = (
        xp.sqrt(xp.maximum(r * rho, 0.0)) for r, rho in zip(face, structure, strict=True)
    )
    largest, least = xp.maximum(*structure), xp.minimum(*face)
    return xp.reciprocal(xp.maximum(xp.fma(-first, second, 1.0), largest * (1.0 - least)))


def transmitted(
    jones: Jones, geometry: Geometry, index: Index, came: Powers, left: Powers
) -> Jones:
    """Return √(T T G) J, the structure's matrix as seen from outside of the coat.

    Parameters
    ----------
    jones, geometry, index : of the structure in the coat; index over that of the coat.
    came, left : `transmittances` of the incident and of the outgoing light.
    """
    mirror_i = amplitudes(geometry.cos_i, geometry.square_i, index)
    mirror_o = amplitudes(geometry.cos_o, geometry.square_o, index)
    factors = []
    for out in range(2):
        for into in range(2):
            through = came[into], left[out]
            structure = squared(mirror_i[into]), squared(mirror_o[out])
            again = bounced((1.0 - through[0], 1.0 - through[1]), structure)
            factors.append(through[0] * through[1] * again)
    return tuple(
        entry * of(factor).sqrt(factor) for entry, factor in zip(jones, factors, strict=True)
    )


def cosine_within(cosine: Number, n: Number) -> Number:
    """Return the cosine in a coat of relative index n, for the cosine outside."""
    return of(cosine, n).sqrt(of(cosine, n).maximum(cosine * cosine + (n * n - 1.0), 1e-12)) / n


def coated_reflectance(face: Number, beneath: Number) -> Number:
    """Return 1 − T T/(1 − R R), the reflectance of a flat coated interface.

    face, beneath : reflectances of the coat's face and of the interface beneath it.
    """
    # Mirrors that reflect everything let nothing through
    less = of(face, beneath).maximum(1.0 - face * beneath, 1e-6)
    return 1.0 - (1.0 - face) * (1.0 - beneath) * of(less).reciprocal(less)


def pair_power(
    jones: Callable[[Geometry, Index, Heights], Jones] | None,
    wi: Direction,
    wo: Direction,
    index: Index,
    kappa: Number,
    variance: Number,
    came: Powers | None = None,
    left: Powers | None = None,
) -> Number:
    """Return N' of a boundary model for a pair of directions, eq. 5 and 6.

    Parameters
    ----------
    jones : of a `boundary.Model`; None of a perfect reflector.
    wi, wo, index : of the structure, in the coat if it has one.
    kappa, variance : see `boundary.Heights`.
    came, left : transmittances of the coat, see `transmitted`; None without a coat.
    """
    pair = geometry(wi, wo)
    if jones is None:
        return pair.one_plus_dot * pair.one_plus_dot
    matrix = jones(pair, index, Heights(kappa, variance))
    if came is not None and left is not None:
        matrix = transmitted(matrix, pair, index, came, left)
    return power(matrix)


def relative_power(
    jones: Callable[[Geometry, Index, Heights], Jones],
    wi: Direction,
    wo: Direction,
    index: Index,
    kappa: Number,
    variance: Number,
    came: Powers | None = None,
    left: Powers | None = None,
) -> Number:
    """Return N' / (1 + ωi·ωo)²; Kirchhoff's is R(cosθ_half). Arguments as for `pair_power`."""
    # not 0 of opposite grazing directions
    edge = of(kappa).maximum(geometry(wi, wo).one_plus_dot, 1e-12)
    return pair_power(jones, wi, wo, index, kappa, variance, came, left) / (edge * edge)
