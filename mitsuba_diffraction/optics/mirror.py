"""Order 0 as a mirror's lobe that the horizon does not shorten, in any arithmetic.

A flat surface under a Gaussian window reflects light as a mirror does, into a lobe of the window's
width. With u the tangential part of ωi + ωo, and σ₀ of the window,

    f₀ = R(θm) |a₀|² G(u) C(X_i) C(X_o),   G(u) = (kσ₀)²/π exp(−(kσ₀u)²),   X = √(kσ₀) cosθ.

G cosθo dωo is Gaussian over the tangential plane and of integral 1, of which grazing light has a
part beyond the horizon. C makes up for that part. It is the fixed point of

    C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) C(Y) = 1,

so the albedo of a perfect mirror is 1, and no material reflects more than its largest R.

θm is the half vector's angle θh but near the horizon, where light of one direction leaves in a lobe
that reaches as far as reflectances change. There cosθm = cosθh − (h(X_i) + h(X_o))/√(kσ₀). No h
makes the mean of R(θm) over the lobe R(θi) for every R. This h is fitted to that mean of flat
mirrors under windows from 6.4 µm on: Al, Au, Cr and indices 1.33, 1.5, 2.5 and 2.2 + 1.5i, and
lacquered metals. A mean above R(θi) counts 400 times as much as one below. f₀ is reciprocal.

The fit of C, whose equation `reference.mirror` solves, has an error of 0.0006. The mean of R(θm) is
0.97 to 1.01 of R(θi) up to 85° and at least 0.92 at 88°, at 550 nm. A lobe of 6.4 µm reflects more
than a deep minimum of R near the horizon: of Al 1.02 at 650 nm and 1.06 at 800, of Cr 1.04 at 550.
"""

from __future__ import annotations

from .arithmetic import Number, of
from .boundary import Geometry, Jones, facets
from .coat import beneath_amplitudes
from .fresnel import Index, amplitudes

#: Least cosθm: 1 − cos² is below 1 in single precision, where an index of 1 is to reflect nothing.
LEAST_COSINE = 1e-3
# Where C is 1, and h is 0
_X_SQUARE, _X = 4.5, 2.6
#: C − 1 by powers of 1 − X²/4.5, the highest first.
_CORRECTION = 2.427449, -5.601868, 6.095016, -2.704111, 0.48678, -0.054289


def horizon_correction(level_i: Number, level_o: Number, k: Number) -> Number:
    """Return C(X_i) C(X_o).

    level_i, level_o : σ₀ cos²θ of both directions, µm.
    k : 2π/λ, rad/µm.
    """
    return _correction(k, level_i) * _correction(k, level_o)


def _correction(k: Number, level: Number) -> Number:
    xp = of(k, level)
    t = xp.maximum(xp.fma(k, level * (-1.0 / _X_SQUARE), 1.0), 0.0)
    fit = _CORRECTION[0]
    for term in _CORRECTION[1:]:
        fit = xp.fma(t, fit, term)
    return xp.fma(t, fit, 1.0)


def mirror_cosine(cos_half: Number, cos_i: Number, cos_o: Number, sharpness: Number) -> Number:
    """Return cosθm of the half vector's cosine, of both directions, and of kσ₀."""
    xp = of(cos_i, cos_o, sharpness)
    root = xp.sqrt(sharpness)
    shift = _shift(cos_i, root) + _shift(cos_o, root)
    return xp.clip(cos_half - shift * xp.reciprocal(root), LEAST_COSINE, 1.0)


def _shift(cosine: Number, sharpness: Number) -> Number:
    """Return h(X)."""
    xp = of(cosine, sharpness)
    t = xp.maximum(xp.fma(cosine, sharpness * (-1.0 / _X), 1.0), 0.0)
    return t * t * xp.fma(t, xp.fma(t, -0.15472, 1.57203), -0.96359)


def outside_square(cosine: Number, n: Number) -> Number:
    """Return the squared cosine above the surface of a direction within a dielectric.

    It is below 0 beyond the critical angle. n : of the dielectric over the medium above.
    """
    return 1.0 - n * n * (1.0 - cosine * cosine)


def correction_within(
    cos_i: Number, cos_o: Number, n: Number, sigma_0: Number, k: Number
) -> Number:
    """Return C(X_i) C(X_o) of light that is mirrored within a dielectric.

    Light within the cone of the critical angle is mirrored into that cone, and X is that above the
    surface, where light of the same lobe leaves: what is not transmitted is mirrored. Light beyond
    is mirrored between that cone and the horizon, and has a C for either edge. It is 0 where one
    direction is within the cone and the other is beyond.

    sigma_0 : σ₀, µm; k : 2π/λ above, rad/µm.
    """
    into, out = outside_square(cos_i, n), outside_square(cos_o, n)
    xp = of(into, out)
    cone = horizon_correction(sigma_0 * xp.absolute(into), sigma_0 * xp.absolute(out), k)
    horizon = horizon_correction(sigma_0 * n * cos_i * cos_i, sigma_0 * n * cos_o * cos_o, k)
    visible = xp.where(into < 0.0, cone * horizon, cone)
    return xp.where((into < 0.0) & (out < 0.0) | (into >= 0.0) & (out >= 0.0), visible, 0.0)


def mirror(geometry: Geometry, cosine: Number, index: Index, coat: Number | None = None) -> Jones:
    """Return U(ωo) diag(r_s, r_p) U(ωi) of a level facet, with Fresnel's r at cosθm.

    geometry : of the directions at the facet.
    cosine : of θm, outside of a coat.
    index : of the structure, relative to the coat if there is one.
    coat : index of the coat; None without one.
    """
    if coat is not None:
        return facets(geometry, *beneath_amplitudes(cosine, coat, index))
    return facets(geometry, *amplitudes(cosine, 1.0 - cosine * cosine, index))
