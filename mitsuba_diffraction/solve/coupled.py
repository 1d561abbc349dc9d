"""Efficiencies of all channels of a grating by coupled waves in layers, for dielectrics and walls.

The profile is cut into layers with vertical walls, in each of which the field is a sum of modes,
from the Fourier coefficients of ε (Moharam, Grann, Pommet and Gaylord 1995, JOSA A 12, 1068), with
Li's rules for products of discontinuous functions (Li 1996, JOSA A 13, 1870). One reflection matrix
serves all channels. Slopes of metal converge slowly in TM: use the integral method for them.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import toeplitz

from ..errors import DiffractionError
from .profiles import Profile
from .stations import Real, Station

Complex = NDArray[Any]


class CoupledWaves:
    """Coupled waves for one profile.

    Parameters
    ----------
    profile : one period of the grooves; no undercut.
    harmonics : spatial frequencies on either side of the middle one. Slopes are cut into as many
        layers.

    Raises
    ------
    DiffractionError
        If the profile is undercut.
    """

    def __init__(self, profile: Profile, harmonics: int) -> None:
        if (np.diff(profile.x) < 0).any():
            raise DiffractionError(
                f"{profile.name} is undercut, which coupled waves in layers cannot solve; use "
                "method='integral'"
            )
        self.period, self.harmonics = profile.period, harmonics
        levels = np.unique(profile.z)
        edges = levels if _has_walls(profile) else np.linspace(levels[0], levels[-1], harmonics + 1)
        edges = edges[::-1]
        self._top = float(edges[0])
        #: Layers from the top: thickness in µm, and ends (n, 2) of the intervals of material.
        self.layers = [
            (float(above - below), _intervals(profile, float(0.5 * (above + below))))
            for above, below in pairwise(edges)
        ]

    @property
    def name(self) -> str:
        """Name and settings."""
        return f"coupled waves, {2 * self.harmonics + 1} harmonics, {len(self.layers)} layers"

    def amplitudes(self, station: Station) -> Complex:
        """Return the amplitudes between all channels; see `stations.Solver`."""
        if station.indices is None:
            raise DiffractionError(
                "coupled waves need a material with an index; use method='integral' for a perfect "
                "conductor"
            )
        pairs = zip(station.wavelengths, station.indices, station.along, strict=True)
        return np.stack([self._solve(station, *pair) for pair in pairs])

    def _solve(self, station: Station, wavelength: float, index: complex, y: float) -> Complex:
        """Return the amplitudes at one wavelength.

        The reflection matrix R of tangential E is carried up from the material: with modes W, V of
        a layer above an interface and those below it, A = W⁻¹W'(1 + R'), B = V⁻¹V'(1 − R'),
        R = (A − B)(A + B)⁻¹; through a layer of thickness h, R becomes X R X with X = exp(iqh).
        """
        first = station.channels // 2 - self.harmonics
        numbers = np.arange(first, first + 2 * self.harmonics + 1)
        x = np.sqrt(1.0 - y**2) * (1.0 - 2.0 * (numbers + station.fraction) / station.extent)
        epsilon = index**2
        below = _uniform(x, y, epsilon)
        reflection = np.zeros((2 * len(x), 2 * len(x)), complex)
        for thickness, filled in reversed(self.layers):
            above = _layer(x, y, epsilon, filled / self.period)
            reflection = _across(above, below, reflection)
            through = np.exp(2j * np.pi * thickness / wavelength * above.q)
            reflection = through[:, None] * reflection * through
            below = above
        reflection = _across(_uniform(x, y, 1.0), below, reflection)
        places = np.arange(station.channels) - first
        # from the top of the profile to z = 0
        height = np.sqrt(1.0 - y**2 - x[places] ** 2) * self._top / wavelength
        phase = np.exp(-2j * np.pi * height)[:, None]
        return phase[..., None, None] * _amplitudes(reflection, x, y, places) * phase


class _Modes(NamedTuple):
    """Modes exp(iqz) of a layer, z down and lengths over 2π/λ: E = W(c⁺ + c⁻), H = V(c⁺ − c⁻)."""

    q: Complex  # (2n,)
    electric: Complex  # W (2n, 2n): Ex, then Ey
    magnetic: Complex  # V


def _uniform(x: Real, y: float, epsilon: complex) -> _Modes:
    """Return the plane waves of a uniform medium."""
    q = np.sqrt(epsilon - x**2 - y**2 + 0j)
    q = np.tile(np.where(q.imag < 0, -q, q), 2)
    _, right = _products(x, y, *(epsilon * np.eye(len(x)),) * 2)
    return _Modes(q, np.eye(len(q)), right / q)


def _layer(x: Real, y: float, epsilon: complex, filled: Real) -> _Modes:
    """Return the modes of a layer; `filled` (n, 2) intervals of the material, over the period."""
    direct = _toeplitz(len(x), 1.0, epsilon, filled)
    inverse = _toeplitz(len(x), 1.0, 1.0 / epsilon, filled)
    left, right = _products(x, y, direct, np.linalg.inv(inverse))
    square, electric = np.linalg.eig(left @ right)
    q = np.sqrt(square)
    q = np.where(q.imag < 0, -q, q)
    return _Modes(q, electric, (right @ electric) / q)


def _products(x: Real, y: float, along: Complex, across: Complex) -> tuple[Complex, Complex]:
    """Return P and Q of dE/dz = iP H and dH/dz = iQ E (Maxwell's equations, E and H tangential).

    along, across : ε for fields along the walls (y, z), and across them (x).
    """
    one, kx = np.eye(len(x)), np.diag(x)
    scaled = np.linalg.solve(along, one)
    p = np.block(
        [
            [kx @ scaled * y, one - kx @ scaled @ kx],
            [y * scaled * y - one, -y * scaled @ kx],
        ]
    )
    q = np.block([[-kx * y, kx @ kx - along], [across - y * y * one, y * kx]])
    return p, q


def _across(above: _Modes, below: _Modes, reflection: Complex) -> Complex:
    """Return the reflection matrix above an interface from that below it."""
    one = np.eye(len(reflection))
    a = np.linalg.solve(above.electric, below.electric @ (one + reflection))
    b = np.linalg.solve(above.magnetic, below.magnetic @ (one - reflection))
    return np.asarray(np.linalg.solve((a + b).T, (a - b).T).T)


def _amplitudes(reflection: Complex, x: Real, y: float, places: NDArray[np.int64]) -> Complex:
    """Return amplitudes (j, 2, q, 2) between waves that propagate, from R of tangential E.

    With c² = 1 − y², a wave whose E lies along the grooves has E = (−xy, c², …)/c, and one whose B
    does (±z, 0, −x)/c, with the upper sign for light that goes down.
    """
    n, c = len(x), np.sqrt(1.0 - y * y)
    sines, count = x[places], len(places)
    z = np.sqrt(c * c - sines**2)
    incident = np.zeros((2 * n, 2, count), complex)
    channels = np.arange(count)
    incident[places, 0, channels] = -sines * y / c
    incident[n + places, 0, channels] = c
    incident[places, 1, channels] = z / c
    fields = np.tensordot(reflection, incident, 1)
    e = fields[n + places] / c
    b = -(fields[places] * c + e * (sines * y)[:, None, None]) / z[:, None, None]
    flux = np.sqrt(z[:, None, None, None])
    fields = flux * np.stack([e, b], axis=-1)
    return np.asarray(fields.transpose(2, 1, 0, 3) / flux)


def _toeplitz(n: int, outside: complex, inside: complex, filled: Real) -> Complex:
    """Return the Toeplitz matrix of the Fourier coefficients of a layer's ε.

    Harmonic m has the factor exp(−2πi m x): the numbers of channels rise towards −x.
    """
    m = np.arange(-(n - 1), n)
    start, end = filled[:, 0, None], filled[:, 1, None]
    # ∫ exp(2πi m x) dx over the intervals
    middle, width = 0.5 * (start + end), end - start
    terms = (width * np.sinc(m * width) * np.exp(2j * np.pi * m * middle)).sum(axis=0)
    coefficients = (inside - outside) * terms
    coefficients[n - 1] += outside
    return np.asarray(toeplitz(coefficients[n - 1 :], coefficients[n - 1 :: -1]))


def _has_walls(profile: Profile) -> bool:
    """Whether all sides are level or vertical."""
    x, z = profile.closed
    return bool(((np.diff(x) == 0) | (np.diff(z) == 0)).all())


def _intervals(profile: Profile, height: float) -> Real:
    """Return the ends (n, 2) of the intervals of one period in which the profile is higher."""
    x, z = profile.closed
    rises = np.flatnonzero((z[:-1] < height) & (z[1:] >= height))
    falls = np.flatnonzero((z[:-1] >= height) & (z[1:] < height))

    def at(side: NDArray[np.int64]) -> Real:
        share = (height - z[side]) / (z[side + 1] - z[side])
        return np.asarray(x[side] + share * (x[side + 1] - x[side]))

    start, end = at(rises), at(falls)
    if len(start) and end[0] < start[0]:  # the first interval began in the period before
        end = np.append(end[1:], end[0] + profile.period)
    return np.stack([start, end], axis=-1)
