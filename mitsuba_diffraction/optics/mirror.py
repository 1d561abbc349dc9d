"""Order 0 as a mirror's lobe that the horizon does not shorten, in any arithmetic.

A flat surface under a Gaussian window reflects light as a mirror does, into a lobe of the window's
width. With u the tangential part of ωi + ωo, σ₀ of the window, and the half vector's angle θh,

    f₀ = R(θh) |a₀|² G(u) C(X_i) C(X_o),   G(u) = (kσ₀)²/π exp(−(kσ₀u)²),   X = √(kσ₀) cosθ.

G cosθo dωo is Gaussian over the tangential plane and of integral 1, of which grazing light has a
part beyond the horizon. C makes up for that part. It is the fixed point of

    C(X) ∫₀^∞ Y dY/√π exp(−(X² − Y²)²/4) e^{−βY/2} C(Y) = e^{−βX/2}:

with a reflectance R = exp(−βX) near the horizon, R(θh) ≈ √(R(θi) R(θo)) there, and the albedo of
the mirror is R(θi). β = 0 of a mirror that reflects alike at all angles; of dielectrics β is up
to 2, and C up to twice as large. `grazing_slope` measures β across the lobe. f₀ is reciprocal.

C is 1 for X above 2.5, where the lobe ends above the horizon. `reference.mirror` solves the
equation; `log_correction` is a fit to that solution by least squares, of error 0.001 for β = 0
and 0.005 for β up to 2.
"""

from __future__ import annotations

from .arithmetic import Number, formula, is_complex, of
from .boundary import Geometry, Jones, facets
from .fresnel import Filmed, Index, amplitudes, reflectance
from .stack import Stacked

#: X at which the slope is measured; the lobe of grazing light reaches about as far.
SLOPE_AT = 1.25
#: Largest β of the fit. Less of steeper reflectances is returned, never more.
MOST_SLOPE = 2.4
_NEPER = 0.6931471805599453


@formula
def log_correction(x: Number, slope: Number) -> Number:
    """Return ln C at X for a grazing slope β."""
    xp = of(x, slope)
    a = xp.fma(slope, xp.fma(slope, -0.0209, 0.3837), 0.5)
    b = slope * xp.fma(slope, -0.0218, -0.4236)
    c = xp.fma(slope, xp.fma(slope, 0.0554, -0.0347), -0.3652)
    d = xp.fma(slope, xp.fma(slope, -0.053, 0.2363), 0.1532)
    e = xp.fma(slope, -0.1243, -0.0378)
    square = x * x
    series = xp.fma(x, xp.fma(x, xp.fma(x, xp.fma(x, e, d), c), b), a)
    fades = xp.exp(-(square * xp.fma(square, 0.1919, 0.3703)))
    tail = 0.0052 * slope * slope * square * xp.reciprocal(xp.fma(square * square, 0.114, 1.0))
    return xp.fma(series, fades, -tail)


@formula
def horizon_correction(cos_i: Number, cos_o: Number, sharpness: Number, slope: Number) -> Number:
    """Return C(X_i) C(X_o).

    sharpness : √(kσ₀).
    slope : β of `grazing_slope`.
    """
    x_i, x_o = sharpness * cos_i, sharpness * cos_o
    return of(x_i, x_o, slope).exp(log_correction(x_i, slope) + log_correction(x_o, slope))


@formula
def grazing_slope(index: Index, sharpness: Number) -> Number:
    """Return β, by which R falls as exp(−βX) from the horizon to the end of a grazing lobe.

    It is 0 where reflectances do not fall like that: of total reflection, and under films and
    stacks, whose fringes go up and down.
    """
    xp = of(sharpness)
    if isinstance(index, Filmed | Stacked):
        return 0.0 * sharpness
    cosine = xp.minimum(SLOPE_AT * xp.reciprocal(sharpness), 1.0)
    falls = xp.log2(xp.maximum(reflectance(cosine, index), 1e-6)) * (-_NEPER / SLOPE_AT)
    epsilon = index * index
    total = xp.absolute((epsilon.real if is_complex(epsilon) else epsilon) - 0.5) < 0.5
    return xp.where(total, 0.0, xp.clip(falls, 0.0, MOST_SLOPE))


def mirror(geometry: Geometry, index: Index) -> Jones:
    """Return U(ωo) diag(r_s, r_p) U(ωi) of a level facet, with Fresnel's r at the half vector."""
    cosine = geometry.cos_half
    return facets(geometry, *amplitudes(cosine, 1.0 - cosine * cosine, index))
