"""Efficiencies of sloped gratings by Chandezon's method, in coordinates that follow them.

The surface is r(u) = (X, Z), and points are r(u) + v d with a constant direction d. A vertical d is
the method of Chandezon, Dupuis, Cornet and Maystre 1982 (J. Opt. Soc. Am. 72, 839); a tilted d also
takes grooves with one vertical wall (Plumey, Guizal and Chandezon 1997, J. Opt. Soc. Am. A 14,
610). Steps of u are short beside edges (Vallius 2002, J. Opt. Soc. Am. A 19, 1726).

With r' = B d + J d⊥ and d⊥ across d, a field F(u) exp(iρv) of harmonics α in u obeys

    (α − ρB) J⁻¹ (α − ρB) F = (k² − ρ²) J F,                                            (1)

where B and J stand for their Toeplitz matrices. They multiply derivatives of the field along and
across d, which are continuous in a medium, so that Laurent's rule holds (Li 1996, J. Opt. Soc. Am.
A 13, 1870). In all mounts E and B along the grooves obey (1), with k across the grooves.

Films are bounded by the surface moved along d, on which modes have the factor exp(iρv). Their
admittance is carried up from the material: with fields ψ = (E, B) along the grooves, and fields
φ = Yψ across them,

    (Y − Y⁺) F⁺ a = (Y⁻ − Y) F⁻ b                                                       (2)

has the amplitudes a of modes upwards, in modes b downwards, with admittances Y⁺ and Y⁻ alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, toeplitz

from ...arrays import Real
from ...errors import DiffractionError
from .films import Structure
from .profiles import Profile
from .stations import Station

#: Real or complex numbers.
Numbers = NDArray[Any]

# Samples of a period, from which Fourier coefficients are taken
_SAMPLES = 8192
# Steps of u at edges over the even steps
_AT_EDGES = 0.02
# Sides must turn by less: d lies above all of them
_WIDEST = np.radians(175.0)
# Slope up to which films are moved along z, so that they are as thick along z everywhere
_UPRIGHT = np.radians(80.0)
# Straight sides of a profile with edges at most: each needs some hundred samples
_MOST_SIDES = 32


class Chandezon:
    """Chandezon's method for one profile; a `solve.stations.Solver`.

    Raises a DiffractionError if grooves have vertical walls on both sides, are undercut, or have
    too many edges.

    Parameters
    ----------
    profile : one period of the grooves: smooth, or of few straight sides.
    harmonics : spatial frequencies on either side of the middle one.
    structure : films on the profile, as thick along z everywhere. On a profile with walls the film
        is the profile moved obliquely: it has its thickness on the widest side, and coats walls.
    """

    def __init__(
        self, profile: Profile, harmonics: int, structure: Structure | None = None
    ) -> None:
        self.period, self.harmonics = profile.period, harmonics
        if reason := refused(profile):
            raise DiffractionError(
                f"{profile.name} {reason}, which Chandezon's method cannot solve; use "
                "method=integral"
            )
        x, z = profile.closed
        angles = np.arctan2(np.diff(z), np.diff(x))
        films = structure.films if structure else ()
        middle = float(0.5 * (angles.min() + angles.max()))
        if films and np.abs(angles).max() < _UPRIGHT:
            middle = 0.0
        #: Direction d, and lengths of films along it, µm.
        self._direction = -np.sin(middle), np.cos(middle)
        widest = angles[np.argmax(np.diff(x))]
        lengthened = np.cos(widest) / np.cos(widest - middle)
        self._lengths = [film.thickness * float(lengthened) for film in films]
        self._curve = curve = _curve_of(profile)
        #: J and B of the samples.
        self._across = curve.slope_x * np.cos(middle) + curve.slope_z * np.sin(middle)
        self._along = curve.slope_z * np.cos(middle) - curve.slope_x * np.sin(middle)

    @property
    def name(self) -> str:
        """Name and settings."""
        return f"Chandezon's method, {2 * self.harmonics + 1} harmonics"

    def amplitudes(self, station: Station) -> Numbers:
        """Return the amplitudes between all channels; see `stations.Solver`.

        Raises a DiffractionError if the material is a perfect conductor, or a thin sheet.
        """
        if station.indices is None or station.thin:
            raise DiffractionError(
                "Chandezon's method solves reflection by a material with an index; use "
                "method=integral for perfect conductors and thin sheets"
            )
        k = np.pi * station.extent / self.period
        first = station.channels // 2 - self.harmonics
        numbers = np.arange(first, first + 2 * self.harmonics + 1)
        sines = 1.0 - 2.0 * (numbers + station.fraction) / station.extent
        alpha = np.asarray(k * sines, np.float64)
        places = np.arange(station.channels) - first
        beta = np.sqrt(k**2 - alpha[places] ** 2)
        down = self._plane_waves(alpha, places, -beta)
        above = self._modes(alpha, k**2, 1.0)
        indices = np.stack([station.indices, *station.media], axis=-1)
        pairs = zip(station.wavelengths, indices, station.along, strict=True)
        factor = self._factor(alpha[places], beta)
        return np.stack(
            [
                factor * _reflected(above, self._admittance(alpha, *pair), down, alpha * pair[2], k)
                for pair in pairs
            ]
        )

    def _factor(self, alpha: Real, beta: Real) -> Numbers:
        """Return the ratio of fluxes (j, 1, q, 1), with phases from the top of films to z = 0."""
        x, z = (sum(self._lengths) * part for part in self._direction)
        came, left = np.exp(1j * (alpha * x - beta * z)), np.exp(-1j * (alpha * x + beta * z))
        flux = np.sqrt(beta / beta[:, None]) * came[:, None] * left
        return np.asarray(flux[:, None, :, None])

    def _admittance(self, alpha: Real, wavelength: float, indices: Numbers, y: float) -> Numbers:
        """Return Y (2n, 2n) of the material under its films, see (2).

        indices : of the material, and of the films upwards.
        """
        wavenumber = 2.0 * np.pi / wavelength
        squared = wavenumber**2 * (indices**2 - y**2)
        media = list(zip(indices**2, squared, strict=True))
        epsilon, square = media[0]
        total = _admittance(self._modes(alpha, square, -1.0), alpha * y, epsilon, square)
        for length, (epsilon, square) in zip(self._lengths, media[1:], strict=True):
            up, down = (self._modes(alpha, square, sign) for sign in (1.0, -1.0))
            rising, falling = (
                _admittance(waves, alpha * y, epsilon, square) for waves in (up, down)
            )
            fields, came = (block_diag(waves.field, waves.field) for waves in (up, down))
            back = np.linalg.solve((total - rising) @ fields, (falling - total) @ came)
            there, here = (
                np.tile(np.exp(1j * sign * waves.rho * length), 2)
                for sign, waves in ((1.0, up), (-1.0, down))
            )
            upwards = fields @ (there[:, None] * back * here)
            both = rising @ upwards + falling @ came
            total = np.linalg.solve((upwards + came).T, both.T).T
        return np.asarray(total)

    def _modes(self, alpha: Real, squared: complex, sign: float) -> _Waves:
        """Return the modes of (1) of a medium of this k², upwards (sign 1) or downwards (−1).

        Those that decay least approximate the waves that propagate, which are known and come last.
        """
        n = len(alpha)
        across, along = (_toeplitz(values, n) for values in (self._across, self._along))
        inverse = np.linalg.inv(across)
        quadratic = along @ inverse @ along + across
        linear = alpha[:, None] * (inverse @ along) + (along @ inverse) * alpha
        constant = squared * across - alpha[:, None] * inverse * alpha
        lower = np.linalg.solve(quadratic, np.hstack([constant, linear]))
        rho, vectors = np.linalg.eig(np.vstack([np.eye(n, 2 * n, n), lower]))
        z = np.sqrt(squared - alpha**2 + 0j)
        known = np.flatnonzero(z.imag == 0.0)
        order = np.argsort(-sign * rho.imag)[: n - len(known)]
        rho, field = rho[order], vectors[:n, order]
        # derivative along d⊥, over i
        beside = inverse @ (alpha[:, None] * field - rho * (along @ field))
        waves = self._plane_waves(alpha, known, sign * z[known].real)
        normal = 1j * (rho * (across @ field) - along @ beside)
        return _Waves(
            np.hstack([field, waves.field]), np.hstack([normal, waves.normal]),
            np.hstack([rho, waves.rho]),
        )  # fmt: skip

    def _plane_waves(self, alpha: Real, places: NDArray[np.int64], beta: Real) -> _Waves:
        """Return the waves exp(iαx + iβz) of some places on the surface."""
        curve, columns = self._curve, []
        for place, b in zip(places, beta, strict=True):
            a = alpha[place]
            wave = np.exp(1j * (a * (curve.x - curve.u) + b * curve.z))
            normal = 1j * (b * curve.slope_x - a * curve.slope_z) * wave
            frequencies = place - np.arange(len(alpha))
            columns.append([_coefficients(values)[frequencies] for values in (wave, normal)])
        shape = (len(places), 2, len(alpha))
        x, z = self._direction
        rho = alpha[places] * x + beta * z + 0j
        field, normal = np.array(columns, complex).reshape(shape).transpose(1, 2, 0)
        return _Waves(field, normal, rho)


def refused(profile: Profile) -> str:
    """Return the reason why the method cannot solve a profile; "" if it can."""
    x, z = profile.closed
    if np.ptp(np.arctan2(np.diff(z), np.diff(x))) > _WIDEST:
        return "has walls on both sides, or an undercut"
    if profile.corners == 0:
        return "" if (np.diff(x) > 0).all() else "has a vertical or overhanging side"
    return f"has edges and over {_MOST_SIDES} sides" if len(profile.x) > _MOST_SIDES else ""


def stretched_period(profile: Profile) -> float:
    """Return the period times the largest |r'|, µm: over λ, harmonics of waves along a facet."""
    curve = _curve_of(profile)
    return float(np.hypot(curve.slope_x, curve.slope_z).max() * profile.period)


def _curve_of(profile: Profile) -> _Curve:
    x, z = profile.closed
    return _smooth(x, z) if profile.corners == 0 else _with_edges(x, z)


class _Curve(NamedTuple):
    """Samples of r(u) and r', lengths in µm."""

    u: Real
    x: Real
    z: Real
    slope_x: Real
    slope_z: Real


class _Waves(NamedTuple):
    """Harmonics (n, waves) of fields on the surface, and of |r'| times the normal derivative.

    rho : (waves,) rate along d.
    """

    field: Numbers
    normal: Numbers
    rho: Numbers


def _admittance(waves: _Waves, along: Real, epsilon: complex, squared: complex) -> Numbers:
    """Return Y (2n, 2n) of waves in one direction in a medium.

    along : α y. squared : k² across the grooves.

    B is that along −y, of light whose E is along d × y. Fields across the grooves are
    (y ∂_u E + ∂_n B)/k² and (y ∂_u B − ε ∂_n E)/k², over ik₀.
    """
    turn, slope = np.diag(1j * along), np.linalg.solve(waves.field.T, waves.normal.T).T
    return np.block([[turn, slope], [-epsilon * slope, turn]]) / squared


def _reflected(above: _Waves, below: Numbers, down: _Waves, along: Real, k: float) -> Numbers:
    """Return the fields (j, 2, q, 2) of the last waves above, in light of the waves `down`.

    below : admittance under the surface. along, k : as for `_admittance`, above it.
    """
    system = k**2 * (below - _admittance(above, along, 1.0, k**2))
    source = down.normal - np.linalg.solve(above.field.T, above.normal.T).T @ down.field
    none, count = np.zeros_like(source), source.shape[1]
    surface = np.linalg.solve(system, np.block([[none, source], [-source, none]]))
    incident = np.block([[down.field, none], [none, down.field]])
    e, b = np.split(surface - incident, 2)
    waves = np.stack([np.linalg.solve(above.field, part)[-count:] for part in (e, b)], axis=1)
    return np.asarray(waves.reshape(count, 2, 2, count).transpose(3, 2, 0, 1))


def _smooth(x: Real, z: Real) -> _Curve:
    """Return a profile without edges over even steps of x; slopes from its vertices."""
    period = x[-1] - x[0]
    u = x[0] + _places() * period
    slope = np.interp(u, 0.5 * (x[1:] + x[:-1]), np.diff(z) / np.diff(x), period=period)
    return _Curve(u, u, np.interp(u, x, z), np.ones_like(u), slope)


def _with_edges(x: Real, z: Real) -> _Curve:
    """Return a profile of straight sides; short ones have a larger share of u than of length."""
    t, period = _places(), x[-1] - x[0]
    shares = np.sqrt(np.hypot(np.diff(x), np.diff(z)))
    ends = np.rint(np.append(0.0, np.cumsum(shares / shares.sum())) * _SAMPLES) / _SAMPLES
    side = np.searchsorted(ends, t) - 1
    width = np.diff(ends)[side]
    place = 2.0 * np.pi * (t - ends[side]) / width
    moved = (place - (1.0 - _AT_EDGES) * np.sin(place)) / (2.0 * np.pi)
    rate = (1.0 - (1.0 - _AT_EDGES) * np.cos(place)) / (width * period)
    dx, dz = np.diff(x)[side], np.diff(z)[side]
    return _Curve(t * period, x[side] + moved * dx, z[side] + moved * dz, rate * dx, rate * dz)


def _places() -> Real:
    return np.asarray((np.arange(_SAMPLES) + 0.5) / _SAMPLES)


def _coefficients(values: Numbers) -> Numbers:
    """Return the means of f exp(−2πimu/d); m is the index, counted from the end below 0."""
    m = np.fft.fftfreq(_SAMPLES, 1.0 / _SAMPLES)
    return np.asarray(np.fft.fft(values) / _SAMPLES * np.exp(-1j * np.pi * m / _SAMPLES))


def _toeplitz(values: Real, n: int) -> Numbers:
    """Return the matrix of a product with f; the numbers of channels rise towards −x."""
    c = _coefficients(values)
    return np.asarray(toeplitz(c[-np.arange(n)], c[:n]))
