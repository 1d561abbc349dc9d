"""Mean of the second order of small slope under a film, for either direction (NumPy, float64).

Small slope's B is of first order in the heights. One part of the next orders' mean over Gaussian
heights (Voronovich 1994, Waves in Random Media 4, 337) depends on one direction alone: on its way
to or from the order, the wave is scattered to another wave and back. The coherent wave loses this
light (Ishimaru 1978, Wave Propagation and Scattering in Random Media, chapter 14). Under a film the
other wave is on another part of the fringes, which matters where they are narrow. With r of the
flat film, and r₂ the mean that the second order adds to it, the power of the mirrored wave is
exp(2m) times that of first order, |r|² exp(−(κσ)²),

    m = Σ Re r* (r₂ + (κσ)² r/2) / Σ |r|²   over s and p,   κ = 2k cosθ, σ² the variance,

and the film's effect on the power of any order, from ωi to ωo, is taken as

    g(ωi) g(ωo),   ln g = m of the film − m of the material without it, limited (`LIMIT`).

It is symmetric, and 1 for a film without contrast; a factor on the heights multiplies ln g by its
square. A wave in between has the weight 1 − exp(−φ²), with φ its distance in the film's fringes:

    φ = 2d Re(β(k) − β(u)),   β = √(ε_film − k²).

Light that changes its direction returns what the other waves take, as it does without a film, where
m gains nothing (docs/validation/layers.md). The heights' spectrum is assumed isotropic, so that g
depends on the angle to the normal alone.

r₂ is from the boundary conditions at both faces, both of the heights h: E_t + ∇h E_z and
H_t + ∇h H_z are continuous. With [x] for x above a face less x below it, a wave of tangential k
drives waves of u = k + ξ, to the first order, by jumps of the tangential fields

    J_E = i u [1/ε] D_z,   J_H = i [ε] ẑ×E_t.

Their fields E' and H', and the terms of second order at one point, drive the first wave by jumps

    J_E = i k [E'_z] + ½ [ε] E_t,   J_H = i ẑ×[ε E'_t] − ½ [ε] H_t.

Time exp(−iωt), lengths over 2π/λ.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from .blend import RoughnessTable, ScaleRoughness, shares
from .fresnel import Filmed, decaying_root

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

#: Raised whenever the computation changes.
VERSION = 2
#: ln g = x is replaced by x/(1 + (x/LIMIT)⁴): where the second order is as large as the first, a
#: series in the heights does not converge, and facets reflect.
LIMIT = 0.5
#: Number of angles from which on ln g is interpolated linearly between this many nodes.
NODES = 46
#: Azimuths of ξ, from 0 to π.
AZIMUTHS = np.pi * (np.arange(12) + 0.5) / 12
#: i|ε − 1| times this is added to ε of film and material, so that a guided mode is no pole between
#: nodes. A third or three times of it changes the films of docs/validation/layers.md by 0.5 %.
MODE_WIDTH = 0.01
#: Reflectance below which the mean is 0.
MIN_LIGHT = 1e-12
#: Bands of the spectrum in an octave, and lines in a band: g has no finer features.
_PER_OCTAVE, _LINES = 4, 3
#: Bands with less than this share of the variance are left out.
_MIN_SHARE = 1e-5
_HORIZON = np.radians(89.5)


def mean_gain(
    cosine: ArrayLike,
    index: Filmed,
    roughness: ScaleRoughness | RoughnessTable,
    wavenumber: float,
    height_scale: float = 1.0,
) -> Real:
    """g at angles of this cosine to the normal, shaped as the cosine.

    Parameters
    ----------
    index : the film at one wavelength.
    roughness : of the surface.
    wavenumber : 2π/λ in the medium above the film, rad/µm.
    height_scale : factor on the heights.
    """
    clipped = np.clip(np.asarray(cosine, np.float64), np.cos(_HORIZON), 1.0)
    if clipped.size < NODES:
        log_gain = exponents(clipped.ravel(), index, roughness, wavenumber).reshape(clipped.shape)
    else:
        numbers = (complex(part) for part in index.parts)
        nodes = _at_nodes(roughness, *numbers, float(wavenumber))
        log_gain = np.interp(np.arccos(clipped), _angles(), nodes)
    return limited(log_gain * height_scale**2)


def limited(exponent: ArrayLike) -> Real:
    """g, (...), from its logarithm before the limit."""
    x = np.asarray(exponent, np.float64)
    return np.exp(x / (1.0 + (x / LIMIT) ** 4))


def exponents(
    cosine: Real, index: Filmed, roughness: ScaleRoughness | RoughnessTable, wavenumber: float
) -> Real:
    """ln g (t,) before the limit at cosines (t,); other arguments as for `mean_gain`."""
    material, film, depth = index.parts
    bare, heights = Filmed(material, film, np.zeros_like(depth)), _heights(roughness, wavenumber)
    of_film = mean_of_waves(cosine, index, *heights, index)
    return of_film - mean_of_waves(cosine, bare, *heights, index)


def coherent(
    cosine: Real, index: complex, roughness: ScaleRoughness | RoughnessTable, wavenumber: float
) -> Real:
    """m (t,) of a material without a film, over all waves in between, at cosines (t,)."""
    return mean_of_waves(cosine, Filmed(index, index, 0.0), *_heights(roughness, wavenumber))


def _heights(roughness: ScaleRoughness | RoughnessTable, wavenumber: float) -> tuple[Real, Real]:
    """|ξ| of the heights' components, (n,), and their variances."""
    spectrum = _spectrum(roughness)
    step = _lines(spectrum.frequency / wavenumber)
    # Components finer than the wavelength scatter into no wave that travels
    power = np.exp(-((0.5 * step) ** 4)) * wavenumber**2
    return step, power * np.repeat(spectrum.variance / _LINES, _LINES)


@lru_cache(maxsize=256)
def _at_nodes(
    roughness: ScaleRoughness | RoughnessTable,
    index: complex,
    film: complex,
    depth: complex,
    wavenumber: float,
) -> Real:
    return exponents(np.cos(_angles()), Filmed(index, film, depth), roughness, wavenumber)


def _angles() -> Real:
    return np.linspace(0.0, _HORIZON, NODES)


@lru_cache(maxsize=32)
def _spectrum(roughness: ScaleRoughness | RoughnessTable) -> ScaleRoughness:
    """A few components of the roughness; for a table, positive components with its σ_q²."""
    if isinstance(roughness, RoughnessTable):
        return _components(roughness)
    place = np.round(np.log2(roughness.frequency) * _PER_OCTAVE).astype(int)
    which = place - place.min(initial=0)
    total = np.bincount(which, roughness.variance).astype(np.float64)
    moment = np.bincount(which, roughness.variance * roughness.frequency)
    kept = total > _MIN_SHARE * total.sum()
    return ScaleRoughness(moment[kept] / total[kept], total[kept])


def _lines(frequency: Real) -> Real:
    """Frequencies (n · _LINES,) of the lines in bands (n,)."""
    places = (np.arange(_LINES) + 0.5) / _LINES - 0.5
    return np.asarray(frequency[:, None] * 2.0 ** (places / _PER_OCTAVE)).ravel()


def _components(roughness: RoughnessTable) -> ScaleRoughness:
    """Fit positive components to the nodes of a table."""
    nodes = roughness.frequencies
    first, last = np.log2(nodes[[0, -1]])
    frequency = 2.0 ** np.arange(first, last + 1.0, 1.0 / _PER_OCTAVE)
    variance, _ = scipy.optimize.nnls(shares(frequency, nodes), roughness.nodes)
    kept = variance > _MIN_SHARE * variance.sum()
    return ScaleRoughness(frequency[kept], variance[kept])


def mean_of_waves(
    cosine: Real,
    index: Filmed,
    step: Real,
    power: Real,
    fringes: Filmed | None = None,
    *,
    azimuths: Real = AZIMUTHS,
    mode_width: float = MODE_WIDTH,
) -> Real:
    """Return m (t,) of one film over waves of heights.

    Parameters
    ----------
    cosine : (t,) of the light's angle to the normal.
    index : material and film.
    step, power : (n,) spatial frequency over k, and variance of k times the heights.
    fringes : film that defines φ; by default all waves count in full.
    azimuths : of ξ, radians.
    mode_width : see `MODE_WIDTH`.
    """
    sine = np.sqrt(1.0 - cosine**2)
    ux = sine[:, None, None] + step[:, None] * np.cos(azimuths)
    uy = step[:, None] * np.sin(azimuths)
    square = np.maximum(ux**2 + uy**2, 1e-20)
    turn = ux / np.sqrt(square), uy / np.sqrt(square)
    wave, between = (_Film(k2, index, mode_width) for k2 in (sine**2, square))
    seen = np.ones(square.shape)
    if fringes is not None:
        seen = -np.expm1(-(_apart(sine[:, None, None] ** 2, square, fringes) ** 2))
    variance = seen.mean(axis=-1) @ power
    whole, light = np.zeros_like(cosine), np.zeros_like(cosine)
    for p in (False, True):
        came = wave.came(p)
        r = came.amplitude[0] - 1.0
        jumps = (_jumps(between, came, sine, turn) * seen).mean(axis=-1) @ power
        added = wave.returned(came, jumps, sine, variance) + 2.0 * cosine**2 * variance * r
        whole += (r.conj() * added).real
        light += np.abs(r) ** 2
    # a face without contrast reflects no light whose mean could change
    return np.divide(whole, light, out=np.zeros_like(whole), where=light > MIN_LIGHT)


def _apart(square: Real, between: Real, index: Filmed) -> Real:
    """φ between waves of two squared tangential lengths."""
    _, film, depth = index.parts
    first, second = (decaying_root(film**2 - k2 + 0j).real for k2 in (square, between))
    return np.asarray(2.0 * depth.real * (first - second))


class _Light(NamedTuple):
    """Tangential fields of light of one polarisation below both faces, (2, t).

    amplitude : E across k of s light, or H across k of p light.
    other : H along k of s light, or E along k of p light.
    """

    p: bool
    amplitude: Complex
    other: Complex


def _jumps(between: _Film, came: _Light, sine: Real, turn: tuple[Real, Real]) -> Complex:
    """Jumps [E'_z], [ε E'_t] along k and across k of waves in between, (3, 2 faces, ...)."""
    cos, sin = turn
    length = np.sqrt(between.square)
    first, second = came.amplitude[:, :, None, None], came.other[:, :, None, None]
    if came.p:
        along, across, normal = second * cos, -second * sin, -sine[:, None, None] * first
    else:
        along, across, normal = first * sin, first * cos, np.zeros_like(first)
    steps, inverse = (x[:, None, None, None] for x in (between.steps, between.inverse_steps))
    e, _ = between.driven(False, np.zeros_like(across), -1j * steps * across)
    h, e_along = between.driven(True, 1j * steps * along, 1j * length * inverse * normal)
    above, below = (x[:, None, None, None] for x in (between.epsilons[:-1], between.epsilons[1:]))
    normal = -length * (h[0] / above - h[1] / below)
    along, across = (x[0] * above - x[1] * below for x in (e_along, e))
    return np.stack([normal, along * cos - across * sin, along * sin + across * cos])


class _Film:
    """Waves of one tangential length in air, film and material, of either polarisation.

    The amplitude of s light is E across k; for a wave that goes up H along k is −q times it. The
    amplitude of p light is H across k; E along k is q/ε times it.
    """

    def __init__(self, square: Real, index: Filmed, mode_width: float) -> None:
        material, film, depth = index.parts
        self.square = square
        bare = np.array([1.0, film**2, material**2])
        self.epsilons = bare + 1j * mode_width * np.abs(bare - 1.0)
        self.steps = self.epsilons[:-1] - self.epsilons[1:]
        self.inverse_steps = 1.0 / self.epsilons[:-1] - 1.0 / self.epsilons[1:]
        self._q = [decaying_root(e - square) for e in self.epsilons]
        self._once = np.exp(1j * self._q[1] * depth)

    def came(self, p: bool) -> _Light:
        """Fields of light that comes down from above with an amplitude of 1."""
        above = self._ratios(p)[0]
        unit, zero = np.ones_like(above), np.zeros_like(above)
        fields = self.driven(p, np.stack([unit, zero]), np.stack([-above, zero]))
        return _Light(p, *(below for _, below in fields))

    def returned(self, came: _Light, jumps: Complex, sine: Real, variance: float) -> Complex:
        """Amplitude that waves in between add to the wave that goes up, (t,)."""
        half = 0.5 * variance * self.steps[:, None]
        normal, along, across = jumps
        if came.p:
            driving = 1j * along - half * came.amplitude, 1j * sine * normal + half * came.other
        else:
            driving = half * came.amplitude, -1j * across - half * came.other
        return np.asarray(self.driven(came.p, *driving)[0][0, 0])

    def driven(self, p: bool, jump: Complex, other: Complex) -> tuple[Complex, Complex]:
        """Amplitudes, and fields along k, (2, 2 faces, ...): above each face and below it.

        jump, other : (2 faces, ...) driving jumps of the amplitude and of the field along k.
        """
        above, film, below = self._ratios(p)
        once = self._once
        into = (above * jump[0] - other[0]) / (above + film)
        back = -(below * jump[1] + other[1]) / (film + below)
        upper, lower = (film - above) / (film + above), (film - below) / (film + below)
        rising = (lower * once * into + back) / (1.0 - upper * lower * once**2)
        falling = upper * once * rising + into
        top, bottom = rising * once + falling, rising + falling * once
        amplitude = np.array([[top - jump[0], bottom], [top, bottom + jump[1]]])
        within = film * np.array([rising * once - falling, rising - falling * once])
        along = [[above * amplitude[0, 0], within[1]], [within[0], -below * amplitude[1, 1]]]
        return amplitude, np.array(along)

    def _ratios(self, p: bool) -> list[Complex]:
        """Ratio of the field along k to the amplitude for waves that go up."""
        if p:
            return [q / e for q, e in zip(self._q, self.epsilons, strict=True)]
        return [-q for q in self._q]
