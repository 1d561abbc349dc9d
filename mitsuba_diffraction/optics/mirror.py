"""Order 0 as a mirror's lobe that the horizon does not shorten, in any arithmetic.

A flat surface under a Gaussian window reflects light as a mirror does, into a lobe of the window's
width. With u the tangential part of ωi + ωo, and σ₀ of the window,

    f₀ = R(θm) |a₀|² G(u) C(X_i) C(X_o),   G(u) = (kσ₀)²/π exp(−(kσ₀u)²),   X = √(kσ₀) cosθ.

G cosθo dωo is Gaussian over the tangential plane and of integral 1, of which grazing light has a
part beyond the horizon. C makes up for that part. It is the fixed point of

    C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) C(Y) = 1,

so the albedo of a perfect mirror is 1, and no material reflects more than its largest R.

θm is the half vector's angle θh but near the horizon, where light of one direction leaves in a lobe
that reaches as far as reflectances change. There cosθm = cosθh − (h(X_i) + h(X_o))/√(kσ₀), and the
mean of R(θm) over the lobe is R(θi). h solves

    ∫ p(Y|X) exp(−X/2 − Y/2 + h(X) + h(Y)) dY = exp(−X),   p(Y|X) = C(X) C(Y) Y/√π exp(…),

for the reflectance exp(−X), as dielectrics under narrow windows have it. f₀ is reciprocal.

`reference.mirror` solves both equations. Here are fits: of C with an error of 0.003, and of h with
one of 0.01, which changes R by up to 0.02 where R falls most steeply.
"""

from __future__ import annotations

from .arithmetic import Number, of
from .boundary import Geometry, Jones, facets
from .fresnel import Index, amplitudes

#: Least cosθm: 1 − cos² is below 1 in single precision, where an index of 1 is to reflect nothing.
LEAST_COSINE = 1e-3
# Where C is 1, and h is 0
_X_SQUARE, _X = 4.0, 2.3


def horizon_correction(level_i: Number, level_o: Number, k: Number) -> Number:
    """Return C(X_i) C(X_o).

    level_i, level_o : σ₀ cos²θ of both directions, µm.
    k : 2π/λ, rad/µm.
    """
    return _correction(k, level_i) * _correction(k, level_o)


def _correction(k: Number, level: Number) -> Number:
    xp = of(k, level)
    t = xp.maximum(xp.fma(k, level * (-1.0 / _X_SQUARE), 1.0), 0.0)
    fit = xp.fma(t, xp.fma(t, xp.fma(t, 1.64753, -1.55096), 0.68232), -0.1328)
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
    return t * t * xp.fma(t, xp.fma(t, -1.85638, 3.80759), -1.59677)


def mirror(geometry: Geometry, cosine: Number, index: Index) -> Jones:
    """Return U(ωo) diag(r_s, r_p) U(ωi) of a level facet, with Fresnel's r at cosθm."""
    return facets(geometry, *amplitudes(cosine, 1.0 - cosine * cosine, index))
