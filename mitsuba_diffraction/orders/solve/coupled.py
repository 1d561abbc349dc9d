"""Efficiencies of all channels of a grating by coupled waves in layers, for dielectrics and walls.

The profile is cut into layers with vertical walls, in each of which the field is a sum of modes,
from the Fourier coefficients of ε (Moharam, Grann, Pommet and Gaylord 1995, JOSA A 12, 1068), with
Li's rules for products of discontinuous functions (Li 1996, JOSA A 13, 1870). One reflection matrix
serves all channels. Films on the profile, as thick along z everywhere, are further media of layers:
walls have none, as if they had been evaporated from above. Slices beneath the profile are layers of
their own. Slopes of metal converge slowly in TM: use another method for them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import count, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, toeplitz

from ...arrays import Real
from ...errors import DiffractionError, counted
from .films import Slice, Structure
from .profiles import Profile
from .stations import LEAST_NORMAL, Station

#: Real or complex numbers.
Numbers = NDArray[Any]

# Decimals of µm that tell edges of layers apart
_DIGITS = 9
# |Im q| over Re q up to which a mode travels, but for rounding
_TRAVELLING = 1e-6
# Number of the medium above: the last one
_ABOVE = -1


class _Filled(NamedTuple):
    """Intervals (n, 2) of a layer, over the period, with the numbers of a medium and its surround.

    Media are the profile's material, those of the structure, and the medium above.
    """

    ends: Real
    medium: int
    around: int


class CoupledWaves:
    """Coupled waves for one profile.

    Raises a DiffractionError if an undercut profile has films.

    Parameters
    ----------
    profile : one period of the grooves, which may be undercut, as slanted ridges are.
    harmonics : spatial frequencies on either side of the middle one. Slopes are cut into as many
        layers.
    structure : films on the profile, slices beneath it, and a substrate.
    """

    def __init__(
        self, profile: Profile, harmonics: int, structure: Structure | None = None
    ) -> None:
        around = structure or Structure()
        if around.films and (np.diff(profile.x) < 0).any():
            raise DiffractionError(
                f"{profile.name} is undercut, and films as thick along z everywhere cannot lie on "
                "it; leave out the layers"
            )
        self.period, self.harmonics = profile.period, harmonics
        levels = np.unique(profile.z)
        x, z = (np.diff(values) for values in profile.closed)
        if (x * z).any():  # slopes
            levels = np.linspace(levels[0], levels[-1], harmonics + 1)
        # surfaces of the material and of each film
        offsets = np.append(0.0, np.cumsum([film.thickness for film in around.films]))
        edges = np.unique(np.round(np.add.outer(offsets, levels), _DIGITS))[::-1]
        slices = _slices(around.slices, len(offsets), profile.period)
        self._top = float(edges[0])
        self._bottom = float(edges[-1]) - sum(thickness for thickness, _ in slices)
        self._substrate = 0 if around.substrate is None else len(around.materials)
        #: Layers from the top: thickness in µm, and what fills them.
        self.layers = [
            (float(above - below), _surfaces(profile, float(0.5 * (above + below)), offsets))
            for above, below in pairwise(edges)
        ]
        self.layers += slices

    @property
    def name(self) -> str:
        """Name and settings."""
        layers = counted(len(self.layers), "layer")
        return f"coupled waves, {2 * self.harmonics + 1} harmonics, {layers}"

    def amplitudes(self, station: Station) -> Numbers:
        """Return the amplitudes between all channels; see `stations.Solver`."""
        if station.indices is None:
            raise DiffractionError(
                "coupled waves need a material with an index; use method=integral for a perfect "
                "conductor"
            )
        indices = np.stack([station.indices, *station.media], axis=-1)
        pairs = zip(station.wavelengths, indices, station.along, strict=True)
        return np.stack([self._solve(station, *pair) for pair in pairs])

    def _solve(self, station: Station, wavelength: float, indices: Numbers, y: float) -> Numbers:
        """Return the amplitudes at one wavelength; indices of the material, and of the structure.

        The scattering matrix of tangential E is carried up from the material (`_across`); through a
        layer of thickness h, R becomes X R X, U becomes X U, and D becomes D X, with X = exp(iqh).
        """
        first = station.channels // 2 - self.harmonics
        numbers = np.arange(first, first + 2 * self.harmonics + 1)
        x = np.sqrt(1.0 - y**2) * station.sines_of(numbers)
        waves = x, np.full(len(x), y)
        media = np.append(indices**2, 1.0)
        layers = (
            (thickness / wavelength, _layer(*waves, media, filled))
            for thickness, filled in reversed(self.layers)
        )
        # of a sheet; a metal, whose index is complex, has no channels
        inner = Inner(station.inside - first, abs(indices[0]), self._bottom / wavelength)
        return scattered(
            waves, layers, media[self._substrate], np.arange(station.channels) - first,
            self._top / wavelength, inner,
        )  # fmt: skip


class Modes(NamedTuple):
    """Modes exp(iqz) of a layer, z down and lengths over 2π/λ: E = W(c⁺ + c⁻), H = V(c⁺ − c⁻)."""

    q: Numbers  # (2n,)
    electric: Numbers  # W (2n, 2n): Ex, then Ey
    magnetic: Numbers  # V


class _Scattering(NamedTuple):
    """Scattering of all that lies below, between the modes of a layer and waves in the material.

    Attributes
    ----------
    back : R (2n, 2n), from downward modes to upward ones.
    up : U (2n, m), from upward waves in the material, the tangential E of its ports, to modes.
    down : D (m, 2n), from downward modes to downward waves in the material.
    inner : (m, m), from upward waves in the material to downward ones.
    """

    back: Numbers
    up: Numbers
    down: Numbers
    inner: Numbers


class Inner(NamedTuple):
    """Channels of light from within a clear material.

    harmonics : their places among all; none of a material that no light leaves.
    refractive : index of the material.
    height : of the lowest layer's lower side, over the wavelength.
    """

    harmonics: NDArray[np.int64]
    refractive: float
    height: float


def scattered(
    waves: tuple[Real, Real], layers: Iterable[tuple[float, Modes]], epsilon: complex,
    above: NDArray[np.int64], top: float, inner: Inner,
) -> Numbers:  # fmt: skip
    """Return the amplitudes (ports, 2, ports, 2) of layers on a material; see `Solver`.

    Parameters
    ----------
    waves : x and y of all harmonics, (n,), tangential parts of wave vectors over 2π/λ.
    layers : thickness over the wavelength, and modes, from the material upwards.
    epsilon : ε of the material.
    above : places of the channels above among the harmonics.
    top : height of the uppermost layer, over the wavelength.
    inner : channels within the material.
    """
    x, y = waves
    below, total = uniform(x, y, epsilon), _material(len(x), inner.harmonics)
    for thickness, modes in layers:
        total = _across(modes, below, total)
        through = np.exp(2j * np.pi * thickness * modes.q)[:, None]
        total = _Scattering(
            through * total.back * through.T, through * total.up, total.down * through.T,
            total.inner,
        )  # fmt: skip
        below = modes
    total = _across(uniform(x, y, 1.0), below, total)
    sides = (
        _Side(x[above], y[above], 1.0, -top),
        _Side(x[inner.harmonics], y[inner.harmonics], inner.refractive, inner.height),
    )
    return _amplitudes(total, np.concatenate([above, len(x) + above]), sides)


def uniform(x: Real, y: Real, epsilon: complex) -> Modes:
    """Return the plane waves of a uniform medium."""
    q = np.sqrt(epsilon - x**2 - y**2 + 0j)
    q = np.tile(np.where(q.imag < 0, -q, q), 2)
    _, right = _products(x, y, *(epsilon * np.eye(len(x)),) * 3)
    return Modes(q, np.eye(len(q)), right / q)


def modes(x: Real, y: Real, across_x: Numbers, across_y: Numbers, along: Numbers) -> Modes:
    """Return the modes of a layer whose ε is a matrix for Ex, for Ey and for Ez."""
    left, right = _products(x, y, across_x, across_y, along)
    square, electric = np.linalg.eig(left @ right)
    q = np.sqrt(square)
    # rounding decides the sign of Im q of modes that travel: their Re q is positive
    q = np.where((q.imag < 0) & (np.abs(q.imag) > _TRAVELLING * q.real), -q, q)
    return Modes(q, electric, (right @ electric) / q)


def _layer(x: Real, y: Real, media: Numbers, filled: Sequence[_Filled]) -> Modes:
    """Return the modes of a layer; media : ε by number."""
    shares = [float(np.sum(part.ends[:, 1] - part.ends[:, 0])) for part in filled]
    if all(share in (0.0, 1.0) for share in shares):
        return uniform(x, y, complex(_summed(media, filled, shares, 1.0)))
    direct = _toeplitz(len(x), media, filled)
    inverse = _toeplitz(len(x), 1.0 / media, filled)
    return modes(x, y, np.linalg.inv(inverse), direct, direct)


def _products(
    x: Real, y: Real, across_x: Numbers, across_y: Numbers, along: Numbers
) -> tuple[Numbers, Numbers]:
    """Return P and Q of dE/dz = iP H and dH/dz = iQ E (Maxwell's equations, E and H tangential)."""
    one, inverse = np.eye(len(x)), np.linalg.inv(along)
    from_x, from_y = x[:, None] * inverse, y[:, None] * inverse
    p = np.block([[from_x * y, one - from_x * x], [from_y * y - one, -from_y * x]])
    both = np.diag(x * y)
    q = np.block([[-both, np.diag(x * x) - across_y], [across_x - np.diag(y * y), both]])
    return p, q


def _material(size: int, inside: NDArray[np.int64]) -> _Scattering:
    """Return the scattering of the material alone, with ports at some of its harmonics."""
    ports = np.eye(2 * size, dtype=complex)[np.concatenate([inside, size + inside])]
    nothing = np.zeros((2 * size, 2 * size), complex)
    return _Scattering(nothing, ports.T, ports, np.zeros((len(ports), len(ports)), complex))


def _across(above: Modes, below: Modes, lower: _Scattering) -> _Scattering:
    """Return the scattering above an interface from that below it.

    With A = W⁻¹W' and B = V⁻¹V' and light e from within the material, modes above and below are
    c⁺ = M d⁺ + ½(A − B) U e and c⁻ = N d⁺ + ½(A + B) U e, of 2M = A(1 + R) + B(1 − R) and
    2N = A(1 + R) − B(1 − R).
    """
    n, one = len(lower.back), np.eye(len(lower.back))
    a = np.linalg.solve(above.electric, below.electric @ np.hstack([one + lower.back, lower.up]))
    b = np.linalg.solve(above.magnetic, below.magnetic @ np.hstack([one - lower.back, lower.up]))
    total, difference = a + b, a - b
    sent, kept = 0.5 * difference[:, n:], 0.5 * total[:, n:]
    rows = np.vstack([difference[:, :n], 2.0 * lower.down])
    rows = np.linalg.solve(total[:, :n].T, rows.T).T
    back, down = rows[:n], rows[n:]
    return _Scattering(back, kept - back @ sent, down, lower.inner - down @ sent)


def _amplitudes(total: _Scattering, rows: NDArray[np.int64], sides: tuple[_Side, _Side]) -> Numbers:
    """Return amplitudes (ports, 2, ports, 2) from the scattering of tangential E; see `Solver`.

    rows : of both components of E of the channels above.
    """
    matrix = np.block(
        [[total.back[rows][:, rows], total.up[rows]], [total.down[:, rows], total.inner]]
    )
    above, below = sides
    came = block_diag(above.fields(1.0), below.fields(-1.0))
    left = block_diag(above.fields(-1.0), below.fields(1.0))
    matrix = np.linalg.solve(left, matrix @ came)
    # E and B of the channels above, E and B of those below, to (ports, 2)
    n, m = len(above.x), len(below.x)
    order = np.arange(2 * n).reshape(2, n), 2 * n + np.arange(2 * m).reshape(2, m)
    ports = np.concatenate(order, axis=1).T
    phase = np.concatenate([side.phase for side in sides])
    result = matrix.T[ports[:, :, None, None], ports] * phase[:, None, None, None]
    return np.asarray(result * phase[:, None])


@dataclass(frozen=True, eq=False)
class _Side:
    """Channels on a side of the profile.

    Attributes
    ----------
    x, y : tangential parts of the wave vectors.
    index : of the medium.
    height : path over the wavelength from the end of the profile to z = 0, along the normal.
    """

    x: Real
    y: Real
    index: float
    height: float

    @property
    def z(self) -> Real:
        """Normal parts of the wave vectors; 1 where none propagates."""
        return np.asarray(np.sqrt(np.where(self._lit, self._square, 1.0)))

    @property
    def phase(self) -> Numbers:
        """Factors that move amplitudes from the end of the profile; 0 where none propagates."""
        return np.asarray(self._lit * np.exp(2j * np.pi * self.height * self.z))

    def fields(self, down: float) -> Real:
        """Return the tangential E (2n, 2n) of waves of unit power, down = 1 or up = −1.

        With k² = n² − y² a wave of unit |E| whose E lies along the grooves has the tangential E
        (−xy, k²)/(n k), and one whose B does has (±z, 0)/k. The power is z.
        """
        # positive, for numbers that are finite where no channel propagates
        k, z = np.sqrt(np.maximum(self.index**2 - self.y**2, 1e-12)), self.z
        rows = (
            (-self.x * self.y / (self.index * k), down * z / k),
            (k / self.index, np.zeros(len(z))),
        )
        return np.block([[np.diag(part / np.sqrt(z)) for part in row] for row in rows])

    @property
    def _square(self) -> Real:
        return np.asarray(self.index**2 - self.y**2 - self.x**2)

    @property
    def _lit(self) -> NDArray[np.bool_]:
        return np.asarray(self._square > (LEAST_NORMAL * self.index) ** 2)


def _toeplitz(n: int, media: Numbers, filled: Sequence[_Filled]) -> Numbers:
    """Return the Toeplitz matrix of the Fourier coefficients of values of `media`, see `_layer`.

    Harmonic m has the factor exp(−2πi m x): the numbers of channels rise towards −x.
    """
    m = np.arange(-(n - 1), n)
    coefficients = _summed(media, filled, [_transform(part.ends, m) for part in filled], m == 0)
    return np.asarray(toeplitz(coefficients[n - 1 :], coefficients[n - 1 :: -1]))


def _transform(ends: Real, m: NDArray[np.int64]) -> Numbers:
    """Return ∫ exp(2πi m x) dx over intervals (n, 2)."""
    middle, width = ends.mean(axis=1)[:, None], np.diff(ends)
    terms = width * np.sinc(m * width) * np.exp(2j * np.pi * m * middle)
    return np.asarray(terms.sum(axis=0))


def _summed(media: Numbers, filled: Sequence[_Filled], parts: Sequence[Any], whole: Any) -> Any:
    """Return the transform of values of `media`, from the transforms of the parts, and of 1."""
    steps = (media[part.medium] - media[part.around] for part in filled)
    return media[_ABOVE] * whole + sum(step * part for step, part in zip(steps, parts, strict=True))


def _surfaces(profile: Profile, height: float, offsets: Real) -> list[_Filled]:
    """Return what lies below the surfaces of the material and of each film at a height, µm."""
    above = [*range(1, len(offsets)), _ABOVE]
    return [
        _Filled(_intervals(profile, height - up) / profile.period, number, above[number])
        for number, up in enumerate(offsets)
    ]


def _slices(
    slices: Sequence[Slice], first: int, period: float
) -> list[tuple[float, list[_Filled]]]:
    """Return slices from the top: thickness, and parts; first : number of their first medium."""
    number, layers = count(first), []
    for thickness, parts in slices:
        ends = np.array([part[1:] for part in parts]).reshape(-1, 1, 2) / period
        layers.append((thickness, [_Filled(each, next(number), _ABOVE) for each in ends]))
    return layers[::-1]


def _intervals(profile: Profile, height: float) -> Real:
    """Return the ends (n, 2) of the intervals of one period that the material fills at a height.

    The material lies on the right of the line: a side that rises begins an interval, also where x
    turns back.
    """
    x, z = profile.closed
    if height < z.min():
        return np.array([[0.0, profile.period]])
    rises = np.flatnonzero((z[:-1] < height) & (z[1:] >= height))
    falls = np.flatnonzero((z[:-1] >= height) & (z[1:] < height))

    def at(side: NDArray[np.int64]) -> Real:
        share = (height - z[side]) / (z[side + 1] - z[side])
        return np.sort((x[side] + share * (x[side + 1] - x[side])) % profile.period)

    start, end = at(rises), at(falls)
    if len(start) and end[0] < start[0]:  # the first interval began in the period before
        end = np.append(end[1:], end[0] + profile.period)
    return np.stack([start, end], axis=-1)
