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

from .arithmetic import Number, formula, of, squared
from .boundary import Direction, Geometry, Jones
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
    """Return G of light that bounces, from √R of the face and √ρ of the structure for both ways."""
    xp = of(*face, *structure)
    first, second = face[0] * structure[0], face[1] * structure[1]
    largest, least = xp.maximum(*structure), xp.minimum(*face)
    passed = xp.fma(-least, least, 1.0)
    return xp.reciprocal(xp.maximum(xp.fma(-first, second, 1.0), largest * largest * passed))


def transmitted(
    jones: Jones, geometry: Geometry, index: Index, n: Number, came: Number, left: Number
) -> Jones:
    """Return √(T T G) J, the structure's matrix as seen from outside of the coat.

    Parameters
    ----------
    jones, geometry, index : of the structure in the coat; index over that of the coat.
    n : index of the coat over that of the medium above.
    came, left : cosines of the incident and of the outgoing light outside.
    """
    # √R by amplitudes: 1 − T would lose it at Brewster's angle
    faces = [_mirrors(c, 1.0 - c * c, n) for c in (came, left)]
    mirrors = [
        _mirrors(geometry.cos_i, geometry.square_i, index),
        _mirrors(geometry.cos_o, geometry.square_o, index),
    ]
    passed, factors = (transmittances(came, n), transmittances(left, n)), []
    for out in range(2):
        for into in range(2):
            again = bounced((faces[0][into], faces[1][out]), (mirrors[0][into], mirrors[1][out]))
            factors.append(passed[0][into] * passed[1][out] * again)
    return tuple(
        entry * of(factor).sqrt(factor) for entry, factor in zip(jones, factors, strict=True)
    )


def _mirrors(cosine: Number, square: Number, index: Index) -> Powers:
    """Return |r_s| and |r_p| of a flat interface."""
    # at 0 the root's derivative would be infinite
    s, p = (of(r).maximum(squared(r), 1e-30) for r in amplitudes(cosine, square, index))
    return of(s).sqrt(s), of(p).sqrt(p)
