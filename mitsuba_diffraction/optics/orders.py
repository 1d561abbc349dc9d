"""Orders of a grating: coordinates of their efficiencies, and lobes under the coherence window.

Formulas for any numbers of `arithmetic`. `orders.cells` explains the coordinates. Period d,
medium of index n, vacuum wavelength λ, wavenumber k = 2π/λ; (u, v) is the tangential part of
ωi + ωo, in the patch's frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .arithmetic import Mask, Number, of
from .coat import transmittances

#: Distance of a coordinate from its ends, 0 and 1, within which it has no derivative.
_LEAST_T = 1e-10
#: 2/π arcsin(√t)/√t up to t = ½ by powers of t, the highest first.
_ARCSINE = (
    0.0648621943, -0.0359524887, 0.0393108678, 0.0245734976, 0.0480890856, 0.106092051, 0.636619832,
)  # fmt: skip


class OrderCell(NamedTuple):
    """Cell of incident light among a grating's orders.

    Attributes
    ----------
    c : √(1 − y²).
    k_continuous : K.
    band : k = ⌊K⌋, at most the last one.
    channel : j = ⌊p⌋.
    kind_a : whether channels 0 … k propagate, not 0 … k − 1.
    t, r : coordinates within the cell, 0 to 1.
    """

    c: Number
    k_continuous: Number
    band: Number
    channel: Number
    kind_a: Mask
    t: Number
    r: Number


def order_cell(
    x: Number, y: Number, inverse: Number, last_band: Number, least: Number
) -> OrderCell:
    """Return the cell of the mirror direction (x, y) within the medium.

    inverse : n d/λ.
    least : positive, against division by 0 where a kind or the y range has no width.
    """
    xp = of(x, y, inverse)
    c = xp.sqrt(xp.maximum(1.0 - y * y, least))
    k_continuous = 2.0 * c * inverse
    p = xp.clip((c - x) * inverse, 0.0, k_continuous)
    band = xp.clip(xp.floor(k_continuous), 0.0, last_band)
    channel = xp.clip(xp.floor(p), 0.0, band)
    r, f = xp.clip(k_continuous - band, 0.0, 1.0), p - channel
    # p = K is the end of kind A's last channel, of which rounding makes kind B's
    kind_a = (f < r) | (channel >= band)
    along, width = xp.where(kind_a, f, f - r), xp.where(kind_a, r, 1.0 - r)
    t = along * xp.reciprocal(xp.maximum(width, least))
    return OrderCell(c, k_continuous, band, channel, kind_a, t, r)


class OrderDirection(NamedTuple):
    """Direction of an order in the medium outside, from the grating equation.

    Attributes
    ----------
    x : tangential component across the grooves; along them it equals the mirror direction's.
    square : squared cosine to the normal, at most 0 of an order that does not propagate.
    """

    x: Number
    square: Number


def order_direction(x: Number, y: Number, order: Number, stride: Number) -> OrderDirection:
    """Return the direction of order m of light along ωi, by the grating equation.

    x, y : tangential part of ωi.
    stride : λ/d.
    """
    xp = of(x, y, order)
    out = xp.fma(order, stride, -x)
    return OrderDirection(out, 1.0 - xp.fma(out, out, y * y))


def crossed_square(x: Number, y: Number, shift_x: Number, shift_y: Number) -> Number:
    """Return the squared cosine of an order of a crossed grating, at most 0 where it is evanescent.

    x, y : tangential part of the mirror direction of the incident light.
    shift_x, shift_y : m_x λ/d_x and m_y λ/d_y.
    """
    out_x, out_y = x + shift_x, y + shift_y
    return 1.0 - out_x * out_x - out_y * out_y


def port_power(z: Number, other: Number) -> Number:
    """Return G = 4z/|z + z'|², the factor of a channel in orders of an interface's light.

    To first order in the heights, an order of s light carries G G' times a constant (Rice 1951,
    Comm. Pure Appl. Math. 4, 351), with G and G' of the channels it comes through and leaves by.

    z : normal part of the wave vector over 2π/λ in the channel's medium, 0 if it does not
        propagate.
    other : square of z' in the other medium, below 0 beyond the critical angle.
    """
    xp = of(z, other)
    total = z + xp.sqrt(xp.maximum(other, 0.0))
    square = xp.where(other > 0.0, total * total, z * z - other)
    return 4.0 * z * xp.reciprocal(xp.maximum(square, 1e-7))  # 0 only where nothing propagates


def order_factor(came: Number, left: Number, zeroth: Mask, index: float) -> Number:
    """Return the factor of an order that leaves a clear surface on the side that light comes from.

    An efficiency over it is smooth beside the order's Rayleigh anomaly and towards grazing. Of
    order 0 it is the reflectance of the flat surface. Of others it is H H', of both directions:
    H = (T_s + T_p/n²)/z' of the flat surface and the normal part z' within, the mean of G of
    `port_power` and of its equal for p light.

    came, left : squared cosines of both directions, in the medium above.
    zeroth : whether it is order 0.
    index : n of the medium below over that above, more than 1.
    """
    xp = of(came, left)
    n, factor, flat = index + 0.0 * came, 1.0 + 0.0 * left, 0.0 * came
    for square in (left, came):
        cosine = xp.sqrt(xp.maximum(square, 0.0))
        s, p = transmittances(cosine, n)
        within = xp.sqrt(cosine * cosine + (index**2 - 1.0))
        factor = factor * (s + p * (1.0 / index**2)) * xp.reciprocal(within)
        flat = 1.0 - 0.5 * (s + p)
    return xp.where(zeroth, flat, factor)


def least_c(index: float) -> float:
    """Return the least c = √(1 − y²) in a medium of light from outside."""
    return math.sqrt(1.0 - 1.0 / index**2)


def smooth_coordinate(t: Number) -> Number:
    """Return τ of t = sin²(πτ/2), in which square roots at both ends vanish, within 1e-7.

    Nearer to an end than τ = 7e-6 it has that value, and no derivative: its slope is infinite.
    """
    xp = of(t)
    square = xp.maximum(xp.minimum(t, 1.0 - t), _LEAST_T)
    fit = _ARCSINE[0]
    for term in _ARCSINE[1:]:
        fit = xp.fma(square, fit, term)
    from_end = xp.sqrt(square) * fit
    return xp.where(t > 0.5, 1.0 - from_end, from_end)


def cell_wavelengths(
    most: Number, shortest: Number, longest: Number, least_c: Number
) -> tuple[Number, Number]:
    """Return the shortest and longest wavelength at which light of some K has a direction.

    most : 2nd/K = λ/c, the longest wavelength of all such light.
    shortest, longest : wavelengths of the table.
    least_c : least c of the light, √(1 − 1/n²) of light that comes from outside the medium.
    """
    xp = of(most)
    low = xp.clip(shortest, least_c * most, most)
    high = xp.clip(longest, least_c * most, most)
    return low, high


def wavelength_coordinate(wavelength: Number, low: Number, high: Number, least: Number) -> Number:
    """Return w, the place of a wavelength between the ends of `cell_wavelengths`, 0 to 1."""
    xp = of(wavelength, low)
    return xp.clip((wavelength - low) * xp.reciprocal(xp.maximum(high - low, least)), 0.0, 1.0)


def order_lobe(across: Number, along: Number, sharpness: Number) -> Number:
    """Return exp(−σ²|q − q_m|²), the lobe of order m over its largest value.

    across, along : of k (u, v) d/2π from (m, 0), in orders.
    sharpness : (2πσ/d)².
    """
    return of(across, along).exp(-sharpness * (across * across + along * along))


def lobe_peak(k: Number, sigma: Number) -> Number:
    """Return k²σ²/π, the largest value of a lobe of efficiency 1."""
    return k * k * (sigma * sigma * (1.0 / math.pi))


def wavenumber_step(u: Number, v: Number, period: Number) -> Number:
    """Return k_1 = 2π|u|/(d(u² + v²)): order m is brightest along a direction at k = m k_1."""
    xp = of(u, v)
    square = xp.maximum(u * u + v * v, 1e-8)
    return xp.maximum(xp.absolute(u), 1e-8) * (2.0 * math.pi / period) * xp.reciprocal(square)


def lobe_falloff(u: Number, v: Number, sigma: Number, period: Number) -> Number:
    """Return c = σ² q_1² v²/(u² + v²); the lobe of order m is at most exp(−c m²) in a direction."""
    xp = of(u, v)
    away = sigma * (2.0 * math.pi) / period * v
    return away * away * xp.reciprocal(xp.maximum(u * u + v * v, 1e-8))
