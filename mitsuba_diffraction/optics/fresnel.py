"""Fresnel's coefficients of a flat interface, bare or under a thin film, in any arithmetic.

Time exp(−iωt), so an absorbing index is n + ik with k ≥ 0. An index that is real by its type is of
a medium without total reflection. Sums are written so that none cancels in single precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .arithmetic import Number, is_complex, of, squared
from .stack import Stacked


@dataclass(frozen=True)
class Filmed:
    """Index of a material under a thin film; accepted wherever an index is.

    Attributes
    ----------
    index : n + ik of the material relative to the medium above the film.
    film : n + ik of the film relative to the medium above it.
    depth : 2πd/λ with the film's thickness d and the wavelength λ in the medium above it. The
        film's lower face is the upper one displaced by d along the vertical.
    """

    index: Number
    film: Number
    depth: Number

    def tilted(self, cosine: Number) -> Filmed:
        """Return the film on a facet whose normal has this cosine to the vertical."""
        return Filmed(self.index, self.film, self.depth * cosine)

    @property
    def phase(self) -> float:
        """Largest phase (rad) of light there and back in the film at normal incidence."""
        _, film, depth = self.parts
        return float(2.0 * np.max((film * depth).real))

    @property
    def advance(self) -> float:
        """Largest phase (rad) by which the fringe advances from the normal to the horizon."""
        _, film, depth = (np.max(np.real(part)) for part in self.parts)
        return float(2.0 * depth * (film - np.sqrt(max(film**2 - 1.0, 0.0))))

    def __getitem__(self, key: Any) -> Filmed:
        """Select elements of all three parts, which are NumPy's, broadcast to one shape."""
        return Filmed(*(part[key] for part in np.broadcast_arrays(*self.parts)))

    @property
    def parts(self) -> tuple[Any, Any, Any]:
        """Index and film as complex arrays, and depth as a real one, of NumPy's."""
        material, film = (np.asarray(part, np.complex128) for part in (self.index, self.film))
        return material, film, np.real(np.asarray(self.depth))


#: Index n + ik relative to the medium above, or of a material under a film, or under a stack.
Index: TypeAlias = Number | Filmed | Stacked


class Face(NamedTuple):
    """Fields at one interface for light that comes down with unit amplitude, over twice its cosine.

    Attributes
    ----------
    contrast : ε below less ε above.
    normal : weight of the product of normal fields.
    s : electric field of s light.
    x, p : tangential field of p light, and its magnetic one over that medium's ε.
    """

    contrast: Number
    normal: Number
    s: Number
    x: Number
    p: Number


class _Layer(NamedTuple):
    """Waves in a film: ε of material and film, q in the film, r_s and r_p there and back."""

    epsilon: Number
    film: Number
    within: Number
    once: Number
    back_s: Number
    back_p: Number


def faces(cosine: Number, square: Number, index: Index) -> list[Face]:
    """Return fields at the interface of a material, or at both interfaces of its film.

    Films follow Born and Wolf, Principles of Optics, section 1.6.4.

    cosine, square : of the angle of incidence, and of its sine the square.
    """
    if not isinstance(index, Filmed):
        n: Number = index
        epsilon = n * n
        inside = decaying_root(epsilon - square)
        xp = of(inside)
        p = xp.reciprocal(epsilon * cosine + inside)
        return [Face(epsilon - 1.0, epsilon, xp.reciprocal(inside + cosine), inside * p, p)]
    epsilon, film, within, once, back_s, back_p = _layer(square, index)
    reciprocal = of(within).reciprocal
    there_s, there_p = back_s * once * once, back_p * once * once
    s = reciprocal(within + cosine - (within - cosine) * there_s)
    p = reciprocal(film * cosine + within + (film * cosine - within) * there_p)
    x, into_s, into_p = within * p, s * once, p * once
    return [
        Face(film - 1.0, film, s * (1.0 + there_s), x * (1.0 - there_p), p * (1.0 + there_p)),
        Face(
            epsilon - film,
            film * reciprocal(epsilon),
            into_s * (1.0 + back_s),
            within * into_p * (1.0 - back_p),
            into_p * (1.0 + back_p),
        ),
    ]


def amplitudes(cosine: Number, square: Number, index: Index) -> tuple[Number, Number]:
    """Amplitude coefficients (r_s, r_p) of reflection, of opposite signs at normal incidence.

    Born and Wolf, Principles of Optics, section 1.5.2 (eq. 21a); complex index as in section 14.2;
    films as in section 1.6.4, from the upper face.

    Parameters
    ----------
    cosine, square : of the angle of incidence, 0 to 1, and of its sine the square.
    index : relative to the medium above.
    """
    if isinstance(index, Stacked):
        return index.amplitudes(cosine)
    if not isinstance(index, Filmed):
        epsilon = index * index
        inside = decaying_root(epsilon - square)  # n cosθ of the refracted wave
        reciprocal = of(inside).reciprocal
        r_s = -((inside - cosine) * reciprocal(inside + cosine))
        return r_s, (epsilon * cosine - inside) * reciprocal(epsilon * cosine + inside)
    _, film, within, once, back_s, back_p = _layer(square, index)
    twice, r = once * once, []
    for q, back in ((cosine, back_s), (film * cosine, back_p)):
        there = back * twice
        r.append(
            ((within + q) * there - (within - q))
            * of(within).reciprocal(within + q - (within - q) * there)
        )
    return r[0], r[1]


def _layer(square: Number, index: Filmed) -> _Layer:
    epsilon, film = index.index * index.index, index.film * index.film
    below, within = decaying_root(epsilon - square), decaying_root(film - square)
    xp = of(within, index.depth)
    outer, inner = epsilon * within, film * below
    phase, decay = within.real * index.depth, xp.exp(-(within.imag * index.depth))
    once = xp.complex(xp.cos(phase) * decay, xp.sin(phase) * decay)
    back_s = (within - below) * xp.reciprocal(within + below)
    back_p = (outer - inner) * xp.reciprocal(outer + inner)
    return _Layer(epsilon, film, within, once, back_s, back_p)


def decaying_root(square: Number) -> Number:
    """Return the root whose wave exp(i root |z|) decays, or else travels, away from the surface."""
    xp = of(square)
    if not is_complex(square):
        return xp.sqrt(xp.maximum(square, 0.0))
    # The larger part from a sum, the other from the product: neither cancels
    length = xp.sqrt(squared(square))
    larger = xp.sqrt(0.5 * (length + xp.absolute(square.real)))
    smaller = 0.5 * square.imag / xp.maximum(larger, 1e-20)
    travels = square.real >= 0.0
    return xp.complex(xp.where(travels, larger, smaller), xp.where(travels, smaller, larger))


def reflectance(cosine: Number, index: Index) -> Number:
    """Reflectance for unpolarised light, the mean of both polarisations; as `amplitudes`."""
    if not isinstance(index, Filmed | Stacked) and is_complex(index):
        return _absorbing_reflectance(cosine, index)
    r_s, r_p = amplitudes(cosine, 1.0 - cosine * cosine, index)
    return 0.5 * (squared(r_s) + squared(r_p))


def _absorbing_reflectance(cosine: Number, index: Number) -> Number:
    """Return |r_s|² (1 + |r_p/r_s|²)/2 with r_p/r_s = (q cosθ − sin²θ)/(q cosθ + sin²θ).

    From Born and Wolf's coefficients, with q = √(ε − sin²θ), in real arithmetic and one division.
    """
    square = 1.0 - cosine * cosine
    inside = decaying_root(index * index - square)
    xp, q, decay = of(cosine, inside), inside.real, inside.imag
    flat = q * cosine
    cross, decay = decay * cosine * (decay * cosine), decay * decay
    less, more = flat - square, flat + square
    ratios = [xp.fma(less, less, cross), xp.fma(more, more, cross)]
    less, more = q - cosine, q + cosine
    above, below = xp.fma(less, less, decay), xp.fma(more, more, decay)
    return 0.5 * above * (ratios[0] + ratios[1]) * xp.reciprocal(below * ratios[1])


def normal_reflectance(index: Index) -> Number:
    """Return R₀ of eq. 9, the reflectance along the normal."""
    if isinstance(index, Filmed | Stacked):
        return squared(amplitudes(1.0, 0.0, index)[0])
    return squared((index - 1.0) * of(index).reciprocal(index + 1.0))
