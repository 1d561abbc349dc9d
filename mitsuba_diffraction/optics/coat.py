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
although the face returns this light and some leaves in the end (docs/validation/layers.md).
"""

from __future__ import annotations

from typing import NamedTuple

from .arithmetic import Number, modulus, of, squared
from .boundary import Direction, Geometry, Jones
from .fresnel import Index, amplitudes

#: Powers of both polarisations, s and p.
Powers = tuple[Number, Number]


class FaceCoefficients(NamedTuple):
    """Face of a coat, as light of one direction sees it from either side.

    Attributes
    ----------
    s, p : transmittances T_s and T_p.
    r_s, r_p : amplitudes reflected outside. √(1 − T) would lose digits at Brewster's angle.
    """

    s: Number
    p: Number
    r_s: Number
    r_p: Number


def refracted(direction: Direction, n: Number) -> Direction:
    """Return a unit vector above the face as it is in the coat, of relative index n."""
    outside_x, outside_y, _ = direction
    x, y = outside_x / n, outside_y / n
    xp = of(x, y)
    # Grazing light would come to lie in the face where the coat is none
    return x, y, xp.sqrt(xp.maximum(1.0 - (x * x + y * y), 1e-12))


def crossing(cosine: Number, n: Number) -> FaceCoefficients:
    """Return T_s, T_p, r_s and r_p of a face, for the cosine of the angle outside."""
    xp = of(cosine, n)
    inside = xp.sqrt(xp.maximum(cosine * cosine + (n * n - 1.0), 0.0))
    outside, steep = 4.0 * cosine * inside, n * n * cosine
    over_s, over_p = xp.reciprocal(inside + cosine), xp.reciprocal(steep + inside)
    return FaceCoefficients(
        outside * (over_s * over_s),
        n * n * outside * (over_p * over_p),
        (cosine - inside) * over_s,
        (steep - inside) * over_p,
    )


def transmittances(cosine: Number, n: Number) -> Powers:
    """Return T_s and T_p of a face for the cosine of the angle outside; equal both ways."""
    s, p, _, _ = crossing(cosine, n)
    return s, p


def passage(through: Number, kept: Number) -> Number:
    """Return T/√N of a face's transmittance T, with N = 1 − ρ (1 − T).

    A mirror of reflectance R under the face sends out T R T/(1 − R (1 − T)). Tables of solved
    orders under a coat hold what is between both passages, times √N √N: R itself if ρ is R, at
    most R if ρ is more, and smooth where T falls to 0.

    kept : ρ, below 1: the largest share of light that the grating sends back.
    """
    xp = of(through, kept)
    return through * xp.reciprocal(xp.sqrt(1.0 - kept * (1.0 - through)))


def face_transmittance(cosine: Number, n: Number) -> Number:
    """Return the transmittance of a face for unpolarised light, for the cosine outside.

    The mean of T = 4ab/(a + b)² of s and p, a = cosθ or n cosθ (Born and Wolf, section 1.5.3).
    """
    xp = of(cosine, n)
    within = xp.sqrt(xp.maximum(n * n - 1.0 + cosine * cosine, 1e-12))  # n cosθ'
    scaled = n * n * cosine
    s, p = cosine + within, scaled + within
    s, p = s * s, p * p
    return 2.0 * cosine * within * (p + n * n * s) * xp.reciprocal(s * p)


def passed_powers(
    geometry: Geometry, index: Index, came: FaceCoefficients, left: FaceCoefficients
) -> list[Number]:
    """Return T T G of the entries of a Jones matrix; arguments as for `transmitted`."""
    xp = of(*came, *left)
    ends = []
    for cosine, square, (t_s, t_p, r_s, r_p) in (
        (geometry.cos_i, geometry.square_i, came),
        (geometry.cos_o, geometry.square_o, left),
    ):
        mirror_s, mirror_p = map(modulus, amplitudes(cosine, square, index))
        s = t_s, xp.absolute(r_s) * mirror_s, mirror_s
        ends.append([s, (t_p, xp.absolute(r_p) * mirror_p, mirror_p)])
    return [_passed(into, out) for out in ends[1] for into in ends[0]]


def _passed(into: tuple[Number, ...], out: tuple[Number, ...]) -> Number:
    """Return T T G of T, |r| of the face times |r| of the structure, and the latter."""
    (t_in, sent_in, mirror_in), (t_out, sent_out, mirror_out) = into, out
    xp = of(*into, *out)
    mirror = xp.maximum(mirror_in, mirror_out)
    least = mirror * mirror * xp.maximum(t_in, t_out)
    bounces = xp.maximum(xp.fma(-sent_in, sent_out, 1.0), least)
    return t_in * t_out * xp.reciprocal(bounces)


def transmitted(
    jones: Jones, geometry: Geometry, index: Index, came: FaceCoefficients, left: FaceCoefficients
) -> Jones:
    """Return √(T T G) J, the structure's matrix as seen from outside of the coat.

    Parameters
    ----------
    jones, geometry, index : of the structure in the coat; index relative to the coat.
    came, left : the face for the incident and for the outgoing light.
    """
    factors = passed_powers(geometry, index, came, left)
    return tuple(
        entry * of(factor).sqrt(factor) for entry, factor in zip(jones, factors, strict=True)
    )


def coated_power(
    jones: Jones, geometry: Geometry, index: Index, came: FaceCoefficients, left: FaceCoefficients
) -> Number:
    """Return N' outside of the coat, the `boundary.power` of `transmitted` without its roots."""
    ss, sp, ps, pp = passed_powers(geometry, index, came, left)
    j_ss, j_sp, j_ps, j_pp = map(squared, jones)
    return 0.5 * (ss * j_ss + sp * j_sp + ps * j_ps + pp * j_pp)


def cosine_within(cosine: Number, n: Number) -> Number:
    """Return the cosine in a coat of relative index n, for the cosine outside."""
    xp = of(cosine, n)
    return xp.sqrt(xp.maximum(cosine * cosine + (n * n - 1.0), 1e-12)) / n


def beneath_amplitudes(cosine: Number, n: Number, index: Index) -> tuple[Number, Number]:
    """Return r_s and r_p of a flat structure under a coat, as seen from outside.

    T r/√(1 − R ρ): for a flat structure the sum over reflections between both is exact.

    cosine : of the angle outside; n : of the coat; index : of the structure relative to the coat.
    """
    within, face = cosine_within(cosine, n), crossing(cosine, n)
    found = []
    for t, back, r in zip(
        face[:2], face[2:], amplitudes(within, 1.0 - within * within, index), strict=True
    ):
        bounces = of(back).maximum(1.0 - back * back * squared(r), 1e-7)
        found.append(r * (t * of(bounces).reciprocal(of(bounces).sqrt(bounces))))
    return found[0], found[1]


def beneath_reflectance(cosine: Number, n: Number, index: Index) -> Number:
    """Return the reflectance of a flat structure under a coat, without the face's own light."""
    s, p = beneath_amplitudes(cosine, n, index)
    return 0.5 * (squared(s) + squared(p))


def coated_reflectance(face: Number, beneath: Number) -> Number:
    """Return 1 − T T/(1 − R R), the reflectance of a flat coated interface.

    face, beneath : reflectances of the coat's face and of the interface beneath it.
    """
    # Mirrors that reflect everything let nothing through
    less = of(face, beneath).maximum(1.0 - face * beneath, 1e-6)
    return 1.0 - (1.0 - face) * (1.0 - beneath) * of(less).reciprocal(less)
