"""Fields at a flat interface, or at both of a film (Dr.Jit): the twin of `optics.fresnel`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi

from .roles import Float, Number


@dataclass(frozen=True)
class Filmed:
    """The index of a material under a thin film (`optics.fresnel.Filmed`), for one channel."""

    index: Number
    film: Number
    depth: Float

    def tilted(self, cosine: Float) -> Filmed:
        """That on a facet whose normal has this cosine to the vertical."""
        return Filmed(self.index, self.film, self.depth * cosine)


#: An index, or that of a material under a film.
Index = Number | Filmed


class Face(NamedTuple):
    """See `optics.fresnel.Face`."""

    contrast: Number
    normal: Number
    s: Number
    x: Number
    p: Number


def faces(q: Float, square: Float, index: Index) -> list[Face]:
    """Fields at the interface, or at both, for light of this cosine and squared sine."""
    if not isinstance(index, Filmed):
        epsilon = index * index
        inside = root(epsilon - square)
        p = dr.rcp(epsilon * q + inside)
        return [Face(epsilon - 1.0, epsilon, dr.rcp(q + inside), inside * p, p)]
    epsilon, film, within, once, back_s, back_p = _film(square, index)
    there_s, there_p = back_s * once * once, back_p * once * once
    s = dr.rcp(within + q + (q - within) * there_s)
    p = dr.rcp(film * q + within + (film * q - within) * there_p)
    x, into_s, into_p = within * p, s * once, p * once
    return [
        Face(film - 1.0, film, s * (1.0 + there_s), x * (1.0 - there_p), p * (1.0 + there_p)),
        Face(
            epsilon - film,
            film * dr.rcp(epsilon),
            into_s * (1.0 + back_s),
            within * into_p * (1.0 - back_p),
            into_p * (1.0 + back_p),
        ),
    ]


def amplitudes(cosine: Float, square: Float, index: Index) -> tuple[Number, Number]:
    """r_s and r_p for the cosine and the squared sine of the angle of incidence."""
    if not isinstance(index, Filmed):
        epsilon = index * index
        inside = root(epsilon - square)
        return (cosine - inside) * dr.rcp(cosine + inside), (
            (epsilon * cosine - inside) * dr.rcp(epsilon * cosine + inside)
        )
    _, film, within, once, back_s, back_p = _film(square, index)
    found = []
    for q, back in ((mi.Complex2f(cosine, 0.0), back_s), (film * cosine, back_p)):
        there = back * once * once
        found.append(
            (q - within + (q + within) * there) * dr.rcp(q + within + (q - within) * there)
        )
    return found[0], found[1]


def _film(square: Float, index: Filmed) -> tuple[Number, ...]:
    """ε of material and film, q of the film, one passage's phase, r_s and r_p of the lower face."""
    epsilon, film = index.index * index.index, index.film * index.film
    below, within = root(epsilon - square), root(film - square)
    outer, inner = epsilon * within, film * below
    sin, cos = dr.sincos(within.real * index.depth)
    decay = dr.exp(-within.imag * index.depth)
    once = mi.Complex2f(cos * decay, sin * decay)
    r_s = (within - below) * dr.rcp(within + below)
    return epsilon, film, within, once, r_s, (outer - inner) * dr.rcp(outer + inner)


def squared(x: Number) -> Float:
    """|x|²."""
    return dr.fma(x.real, x.real, dr.square(x.imag)) if dr.is_complex_v(x) else dr.square(x)


def root(square: Number) -> Number:
    """The root whose wave decays, or else travels, away from the surface."""
    if not dr.is_complex_v(square):
        return dr.safe_sqrt(square)
    # The larger part from a sum, the other from the product: neither cancels
    length = dr.sqrt(squared(square))
    larger = dr.sqrt(0.5 * (length + dr.abs(square.real)))
    smaller = 0.5 * square.imag / dr.maximum(larger, 1e-20)
    travels = square.real >= 0.0
    return mi.Complex2f(dr.select(travels, larger, smaller), dr.select(travels, smaller, larger))
