"""Boundary models: the material's factor on the diffracted power (Dr.Jit).

The twin of `optics.boundary` and `optics.blend`, which give the formulas and their sources. With
J = (1−s) K + s B of small slope (s = 0 is Kirchhoff) and J' = 2 cosθi cosθo J,

    f cosθo = N' / (λ² A w² cosθi) · ⟨|P|²⟩,   N' = ½ Σ|J'|² = R (1 + ωi·ωo)² of Kirchhoff,

and in polarised variants the Mueller matrix of J' takes the place of N'.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..optics.blend import NODES_PER_OCTAVE, RoughnessTable
from ..optics.boundary import checked_model
from ..tables.table import DiffractionTable
from .directions import Pair, TablePoint
from .fresnel import (
    Conductor,
    Dielectric,
    Face,
    Filmed,
    Index,
    Inside,
    Perfect,
    Reflectance,
    amplitudes,
    faces,
    squared,
)
from .layers import CoatedPair, UnderFilm, bounced, transmittances
from .memory import index_between, read_record, upload
from .types import Float, Interaction, Mask, Number, Spectrum, Vector3f

#: Entries ss, sp, ps, pp of a Jones matrix: first the outgoing, then the incident polarisation.
Jones = tuple[Number, Number, Number, Number]

#: Squared sines below which a direction is the normal itself, or two are one
LEVEL = 1e-20


@dataclass(frozen=True)
class Kirchhoff:
    """The tangent plane: Fresnel's coefficients at the half vector."""

    material: Reflectance | Inside | UnderFilm

    def factor(
        self,
        pair: Pair,
        height_scale: Float,
        wavenumbers: list[Float],
        si: Interaction,
        active: Mask,
        mode: mi.TransportMode,
    ) -> Spectrum:
        """Return N' of a pair, or its Mueller matrix, for each channel.

        wavenumbers : of the channels, rad/µm.
        mode : whether light comes along ωo (radiance) or along ωi (importance).
        """
        layered = isinstance(pair, CoatedPair) or isinstance(self.material, UnderFilm)
        if (mi.is_polarized or layered) and not isinstance(self.material, Perfect):
            light = LightPath(pair, mode)
            indices = self.material.indices(si, active)
            matrices = [light.kirchhoff(index) for index in indices]
            return light.of_jones(matrices, indices, self.material)
        reflectance = self.material.reflectance(pair.cos_half, si, active)
        return mi.depolarizer(reflectance * dr.square(pair.one_plus_dot))

    def __str__(self) -> str:
        return "kirchhoff"


class SmallSlope:
    """Small slope, blended with Kirchhoff where the surface is rough at the scale of an order."""

    def __init__(
        self, material: Dielectric | Conductor | Inside | UnderFilm, roughness: RoughnessTable
    ) -> None:
        self.material = material
        self._first = roughness.first
        nodes = roughness.nodes.astype(np.float32)
        self._last = len(nodes) - 2.0
        # A node and the next one side by side, so that one packet load fetches both
        self._nodes = upload(mi.Float, np.stack([nodes[:-1], nodes[1:]], axis=1))

    def of(self, material: Inside) -> SmallSlope:
        """Return the model of another material on the same heights."""
        other = copy.copy(self)
        other.material = material
        return other

    def factor(
        self,
        pair: Pair,
        height_scale: Float,
        wavenumbers: list[Float],
        si: Interaction,
        active: Mask,
        mode: mi.TransportMode,
    ) -> Spectrum:
        """See `Kirchhoff.factor`."""
        light = LightPath(pair, mode)
        indices = self.material.indices(si, active)
        if isinstance(self.material, UnderFilm):
            wavenumbers = self.material.wavenumbers(wavenumbers)
        matrices = [(light.kirchhoff(index), light.small_slope(index)) for index in indices]
        if len(matrices) == 1:  # one index at all wavelengths
            matrices *= len(wavenumbers)
            indices *= len(wavenumbers)
        shares = self.shares(pair, height_scale, wavenumbers, indices)
        blended = [
            tuple(dr.fma(k - b, share, b) for k, b in zip(*both, strict=True))
            for both, share in zip(matrices, shares, strict=True)
        ]
        return light.of_jones(blended, indices, self.material)

    def shares(
        self,
        pair: Pair | TablePoint,
        height_scale: Float,
        wavenumbers: list[Float],
        indices: list[Index],
    ) -> list[Float]:
        """Return Kirchhoff's share 1 − s for each channel, eq. 9.

        Not s: near the horizon K is so large beside B that the last digit of 1 − s counts.
        """
        # An order of no frequency to speak of has the first node's roughness, as q → 0
        squared = dr.maximum(dr.squared_norm(pair.uv), 1e-20)
        start = dr.fma(dr.log2(squared), 0.5 * NODES_PER_OCTAVE, -self._first * NODES_PER_OCTAVE)
        squared_w = dr.square(pair.w * height_scale)
        halves = [0.5 * _of_the_normal(n) for n in indices]
        if len(halves) == 1:
            halves *= len(wavenumbers)
        shares = []
        for k, half in zip(wavenumbers, halves, strict=True):
            place = dr.fma(dr.log2(k), NODES_PER_OCTAVE, start)
            lower = index_between(dr.floor(place), 0.0, self._last)
            low, high = read_record(self._nodes, mi.UInt32(lower), 2)
            variance = dr.lerp(low, high, dr.clip(place - lower, 0.0, 1.0))
            squared = squared_w * dr.square(k) * variance
            shares.append(_one_minus_exp(squared * dr.fma(squared, 1.0 / 3.0, half)))
        return shares

    def __str__(self) -> str:
        return "small_slope"


Boundary = Kirchhoff | SmallSlope

#: Boundaries by the names of `optics.boundary.MODELS`, from a material and a table. The first is
#: the default of a material with an index.
MODELS: dict[str, Callable[[Any, DiffractionTable], Boundary]] = {
    "small_slope": lambda material, table: SmallSlope(material, table.roughness),
    "kirchhoff": lambda material, table: Kirchhoff(material),
}


def boundary_of(model: str, material: Reflectance | UnderFilm, table: DiffractionTable) -> Boundary:
    """Return the boundary of a model; a perfect reflector, without an index, has Kirchhoff's."""
    if isinstance(material, Perfect):
        return Kirchhoff(material)
    return MODELS[checked_model(model, MODELS)](material, table)


def _one_minus_exp(x: Float) -> Float:
    """1 − exp(−x), x ≥ 0, to single precision: near 0 by its series, with an error of x⁵/120."""
    series = x * dr.fma(x, dr.fma(x, dr.fma(x, -1.0 / 24.0, 1.0 / 6.0), -0.5), 1.0)
    return dr.select(x < 0.05, series, 1.0 - dr.exp(-x))


def _of_the_normal(index: Index) -> Float:
    """Return R₀ of eq. 9, the reflectance at normal incidence."""
    if isinstance(index, Filmed):
        return squared(amplitudes(mi.Float(1.0), mi.Float(0.0), index)[0])
    return squared((index - 1.0) / (index + 1.0))


class LightPath:
    """Light along −ω0, then along ω: what Jones matrices need of it besides the index.

    Axes are s = ẑ×d/|ẑ×d| and p = d×s of the direction d of travel, as in `optics.boundary`.
    """

    def __init__(self, pair: Pair, mode: mi.TransportMode) -> None:
        # Unpolarised light knows no difference
        forwards = mode == mi.TransportMode.Importance
        first, second = (pair.wi, pair.wo) if forwards else (pair.wo, pair.wi)
        self._first, self._second = first, second
        self._coat: tuple[tuple[Float, Float], ...] = ()
        self._frames = (-first, second)
        if isinstance(pair, CoatedPair):
            ends = ((outer := pair.outer).wi, outer.wo)
            cosines = (outer.cos_i, outer.cos_o)
            if not forwards:
                ends, cosines = ends[::-1], cosines[::-1]
            self._coat = tuple(transmittances(cosine, pair.n) for cosine in cosines)
            self._frames = (-ends[0], ends[1])
        self._above = pair.outer.above
        if not self._above:
            side = mi.Vector3f(1.0, 1.0, -1.0)
            self._frames = tuple(direction * side for direction in self._frames)
        cosines = (pair.cos_i, pair.cos_o)
        self._q0, self._q = cosines if forwards else cosines[::-1]
        self._cos_half, self._one_plus_dot, self._w = pair.cos_half, pair.one_plus_dot, pair.w
        self._scale = 2.0 * self._q0 * self._q
        self._square0 = dr.square(first.x) + dr.square(first.y)
        self._square = dr.square(second.x) + dr.square(second.y)
        self._level()
        self._facet()

    def _level(self) -> None:
        """t̂·t̂0 and ẑ·(t̂0×t̂); one direction is the other where either is the normal."""
        first, second = self._first, self._second
        slanted = (self._square0 > LEVEL) & (self._square > LEVEL)
        inverse = dr.rsqrt(dr.select(slanted, self._square0, 1.0)) * dr.rsqrt(
            dr.select(slanted, self._square, 1.0)
        )
        # t̂0 points against ω0
        dot = -dr.fma(first.x, second.x, first.y * second.y) * inverse
        self._across = dr.fma(first.x, second.y, -first.y * second.x)
        self._dot = dr.select(slanted, dot, 1.0)
        self._cross = dr.select(slanted, -self._across * inverse, 0.0)
        self._sines = dr.sqrt(dr.select(slanted, self._square0 * self._square, 0.0))

    def _facet(self) -> None:
        """Products of cosine and sine of the turns from s to the facet's s, and back.

        The facet's is along n = ω0×ω; n·s0 and n·p0 make the first turn, n·s and n·p the second.
        """
        first, second, z = self._first, self._second, self._across
        x = dr.fma(first.y, second.z, -first.z * second.y)
        y = dr.fma(first.z, second.x, -first.x * second.z)
        turn0 = dr.fma(x, first.y, -y * first.x)
        turn = dr.fma(y, second.x, -x * second.y)
        length0, length = (dr.fma(t, t, z * z) for t in (turn0, turn))
        apart = (length0 > LEVEL) & (length > LEVEL)
        inverse = dr.rsqrt(dr.select(apart, length0, 1.0)) * dr.rsqrt(dr.select(apart, length, 1.0))
        # Where both directions are one, any facet's axis does: s0
        self._cc = dr.select(apart, turn * turn0 * inverse, self._dot)
        self._cs = dr.select(apart, turn * z * inverse, 0.0)
        self._sc = dr.select(apart, -z * turn0 * inverse, self._cross)
        self._ss = dr.select(apart, -z * z * inverse, 0.0)

    def kirchhoff(self, index: Index) -> Jones:
        """Return 2 cosθi cosθo K, eq. 7 (`optics.boundary.kirchhoff`)."""
        if isinstance(index, Filmed):
            index = index.tilted(0.5 * self._w * dr.rcp(dr.maximum(self._cos_half, 1e-4)))
        square = dr.fma(-self._cos_half, self._cos_half, 1.0)
        return self.of_facet(*amplitudes(self._cos_half, square, index))

    def of_facet(self, r_s: Number, r_p: Number) -> Jones:
        """Return 2 cosθi cosθo J of facets with these coefficients at their own axes."""
        r_s, r_p = r_s * self._one_plus_dot, r_p * self._one_plus_dot
        return (
            r_s * self._cc - r_p * self._ss,
            r_s * self._cs + r_p * self._sc,
            -(r_s * self._sc + r_p * self._cs),
            r_p * self._cc - r_s * self._ss,
        )

    def small_slope(self, index: Index) -> Jones:
        """Return 2 cosθi cosθo B, eq. 8 (`optics.boundary.small_slope`)."""
        ends = faces(self._q0, self._square0, index), faces(self._q, self._square, index)
        parts = [self._of_face(*both) for both in zip(*ends, strict=True)]
        return tuple(sum(x[1:], x[0]) for x in zip(*parts, strict=True))

    def _of_face(self, came: Face, there: Face) -> Jones:
        contrast = came.contrast * self._scale
        out, bent, into = contrast * there.s, contrast * there.x, contrast * there.p
        return (
            -(out * came.s * self._dot),
            out * came.x * self._cross,
            bent * came.s * self._cross,
            bent * came.x * self._dot - into * came.p * came.normal * self._sines,
        )

    def of_jones(
        self,
        matrices: list[Jones],
        indices: list[Index],
        material: Reflectance | Inside | UnderFilm,
    ) -> Spectrum:
        """Return N', or a Mueller matrix, from Jones matrices of each channel or of all.

        ½ Σ|J|², or in polarised variants the Mueller matrix between Mitsuba's bases; through the
        faces of a coat, where there is one.
        """
        if self._coat:
            matrices = [self._transmitted(*both) for both in zip(matrices, indices, strict=True)]
        if mi.is_polarized:
            return self._mueller(matrices)
        powers = [0.5 * sum(map(squared, jones)) for jones in matrices]
        if isinstance(material, UnderFilm):
            powers = material.summed(powers)
        return mi.UnpolarizedSpectrum(powers if len(powers) > 1 else powers[0])

    def _transmitted(self, jones: Jones, index: Index) -> Jones:
        """Return √(T T G) J, through the coat's face on both ways (`optics.coat`)."""
        structure = (
            self._mirrored(self._q0, self._square0, index),
            self._mirrored(self._q, self._square, index),
        )
        factors = []
        for out in range(2):
            for into in range(2):
                through = self._coat[0][into], self._coat[1][out]
                again = bounced(
                    (1.0 - through[0], 1.0 - through[1]), (structure[0][into], structure[1][out])
                )
                factors.append(dr.sqrt(through[0] * through[1] * again))
        return tuple(entry * factor for entry, factor in zip(jones, factors, strict=True))

    def _mirrored(self, cosine: Float, square: Float, index: Index) -> tuple[Float, Float]:
        """Return |r_s|² and |r_p|² of the flat structure."""
        r_s, r_p = amplitudes(cosine, square, index)
        return squared(r_s), squared(r_p)

    def _mueller(self, matrices: list[Jones]) -> Spectrum:
        if not self._above:  # turned over, p points the other way
            matrices = [(ss, -sp, -ps, pp) for ss, sp, ps, pp in matrices]
        return mueller(
            matrices, self._frames, (self._axis(self._frames[0]), self._axis(self._frames[1]))
        )

    def _axis(self, direction: Vector3f) -> Vector3f:
        """s of light along a direction; of the other's where it is the normal, y where both are."""
        level = mi.Vector3f(0.0, 1.0, 0.0)
        for one in (self._second, -self._first, direction):
            square = dr.square(one.x) + dr.square(one.y)
            slanted = square > LEVEL
            inverse = dr.rsqrt(dr.select(slanted, square, 1.0))
            level = dr.select(slanted, mi.Vector3f(-one.y * inverse, one.x * inverse, 0.0), level)
        return level


def turn(to: Vector3f, start: Vector3f, direction: Vector3f) -> tuple[Float, Float]:
    """Return (cos, sin) of the turn from axes (start, d×start) to axes (to, d×to)."""
    return dr.dot(to, start), dr.dot(to, dr.cross(direction, start))


def turned(jones: Jones, out: tuple[Float, Float], into: tuple[Float, Float]) -> Jones:
    """Return the product of the turn `out`, the Jones matrix and the turn `into`."""
    ss, sp, ps, pp = jones
    (c, s), (c0, s0) = out, into
    ss, sp, ps, pp = ss * c + ps * s, sp * c + pp * s, ps * c - ss * s, pp * c - sp * s
    return ss * c0 - sp * s0, ss * s0 + sp * c0, ps * c0 - pp * s0, ps * s0 + pp * c0


def mueller(
    matrices: list[Jones], light: tuple[Vector3f, Vector3f], axes: tuple[Vector3f, Vector3f]
) -> Spectrum:
    """Return Mueller matrices between Mitsuba's bases of light along two directions, per channel.

    axes : s of both, which the Jones matrices are about.
    """
    before = turn(axes[0], mi.mueller.stokes_basis(light[0]), light[0])
    after = turn(mi.mueller.stokes_basis(light[1]), axes[1], light[1])
    entries = [_mueller(turned(jones, after, before)) for jones in matrices]
    if len(entries) == 1:
        return mi.Spectrum(*entries[0])
    return mi.Spectrum(*(mi.UnpolarizedSpectrum(list(x)) for x in zip(*entries, strict=True)))


def _mueller(jones: Jones) -> list[Float]:
    """Return the sixteen entries, row by row (`optics.boundary.mueller`)."""
    ss, sp, ps, pp = jones
    a, b, c, d = (0.5 * squared(x) for x in jones)
    rows, columns = (_product(ss, sp), _product(ps, pp)), (_product(ss, ps), _product(sp, pp))
    same, other = _product(ss, pp), _product(sp, ps)
    real, imag = dr.real, dr.imag
    first, second = rows
    left, right = columns
    return [
        a + b + c + d, a - b + c - d, real(first) + real(second), -imag(first) - imag(second),
        a + b - c - d, a - b - c + d, real(first) - real(second), imag(second) - imag(first),
        real(left) + real(right), real(left) - real(right), real(same) + real(other),
        imag(other) - imag(same),
        imag(left) + imag(right), imag(left) - imag(right), imag(same) + imag(other),
        real(same) - real(other),
    ]  # fmt: skip


def _product(x: Number, y: Number) -> Number:
    """x y*."""
    return x * dr.conj(y) if dr.is_complex_v(x) else x * y
