"""Boundary models: the material's factor on the diffracted power (Dr.Jit).

The formulas are `optics.boundary.MODELS`. With J' = 2 cosθi cosθo J,

    f cosθo = N' / (λ² A w² cosθi) · ⟨|P|²⟩,   N' = ½ Σ|J'|²,

and in polarised variants the Mueller matrix of J' takes the place of N'. Order 0 has the factor
`order_0` in place of N'/(w² cosθi cosθo), which no model decides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..optics.arithmetic import is_complex, of, squared
from ..optics.blend import NODES_PER_OCTAVE, RoughnessTable
from ..optics.boundary import (
    SAME_DIRECTION,
    Geometry,
    Heights,
    Jones,
    Model,
    geometry,
    power,
)
from ..optics.coat import (
    FaceCoefficients,
    beneath_reflectance,
    coated_power,
    crossing,
    transmitted,
)
from ..optics.fresnel import reflectance
from ..optics.mirror import mirror
from .arithmetic import clip, index_of, maximum
from .directions import CoatedPair, Pair, Place
from .materials import Material, Perfect
from .memory import index_between, read_record, upload
from .types import Float, Number, Spectrum, Vector3f


class HeightStatistic:
    """A statistic of the heights at an order's frequency, linear between nodes."""

    def __init__(self, table: RoughnessTable) -> None:
        self._first = table.first
        nodes = table.nodes.astype(np.float32)
        self._last = len(nodes) - 2.0
        # A node and the next one side by side, so that one packet load fetches both
        self._nodes = upload(mi.Float, np.stack([nodes[:-1], nodes[1:]], axis=1))

    def at(self, place: Place, height_scale: Float, wavenumbers: list[Float]) -> list[Heights]:
        """Return κ and the statistic for each channel."""
        uv, w = place
        # An order of no frequency to speak of has the first node's value, as q → 0
        squared = maximum(dr.squared_norm(uv), 1e-20)
        start = dr.fma(dr.log2(squared), 0.5 * NODES_PER_OCTAVE, -self._first * NODES_PER_OCTAVE)
        scaled_w = w * height_scale
        heights = []
        for k in wavenumbers:
            node = dr.fma(dr.log2(k), NODES_PER_OCTAVE, start)
            lower = index_between(dr.floor(node), 0.0, self._last)
            low, high = read_record(self._nodes, index_of(lower), 2)
            variance = dr.lerp(low, high, clip(node - lower, 0.0, 1.0))
            heights.append(Heights(scaled_w * k, variance))
        return heights


@dataclass(frozen=True)
class Boundary:
    """A model of the boundary of a material.

    statistic : of the heights; None where the model does not depend on them.
    """

    model: Model
    material: Material
    statistic: HeightStatistic | None = None

    def on(self, roughness: RoughnessTable) -> Boundary:
        """Return the model on heights of this roughness."""
        if self.model.statistic is None:
            return self
        return replace(self, statistic=HeightStatistic(self.model.statistic(roughness)))

    def factor(
        self,
        pair: Pair,
        height_scale: Float,
        wavenumbers: list[Float],
        indices: list[Number],
        mode: mi.TransportMode,
    ) -> Spectrum:
        """Return N' of a pair, or its Mueller matrix, for each channel.

        wavenumbers : of the channels, rad/µm.
        indices : of the material (`Material.indices`).
        mode : direction of the light, along ωo (radiance) or along ωi (importance).
        """
        if isinstance(self.material, Perfect):
            return mi.depolarizer(mi.UnpolarizedSpectrum(dr.square(pair.one_plus_dot)))
        light = LightPath.of(pair, mode)
        waves = self.material.wavenumbers(wavenumbers)
        heights = self.heights((pair.uv, pair.w), height_scale, waves)
        channels = _side_by_side(indices, heights)
        if self.model.power is not None and not (mi.is_polarized or light.passed):
            powers = [self.model.power(light.pair, index) for index, _ in channels]
            return self.material.channels(powers)
        results: list[Any] = [self.model.jones(light.pair, *channel) for channel in channels]
        if light.passed:
            outside = transmitted if mi.is_polarized else coated_power
            results = [
                outside(jones, light.pair, index, *light.passed)
                for jones, (index, _) in zip(results, channels, strict=True)
            ]
        elif not mi.is_polarized:
            results = [power(jones) for jones in results]
        return light.mueller(results) if mi.is_polarized else self.material.channels(results)

    def heights(
        self, place: Place, height_scale: Float, wavenumbers: list[Float]
    ) -> list[Heights | None]:
        """Return the heights that the model sees: for each channel, or one None."""
        if self.statistic is None:
            return [None]
        return [*self.statistic.at(place, height_scale, wavenumbers)]

    def __str__(self) -> str:
        return self.model.name


def order_0(
    material: Material,
    pair: Pair,
    wavenumbers: list[Float],
    sigma_0: Float,
    indices: list[Number],
    mode: mi.TransportMode,
) -> Spectrum:
    """Return N_0 C(X_i) C(X_o) of eq. 10, or its Mueller matrix, for each channel.

    sigma_0 : σ₀ of the window on the surface, µm; other parameters as of `Boundary.factor`.
    """
    outer, waves = pair.outer, material.wavenumbers(wavenumbers)
    visible = mi.UnpolarizedSpectrum([outer.visible(sigma_0, k) for k in wavenumbers])
    if isinstance(material, Perfect):
        return mi.depolarizer(visible)
    channels = _side_by_side(indices, [outer.mirror_cosine(k * sigma_0) for k in waves])
    coat = pair.n if isinstance(pair, CoatedPair) else None
    if not mi.is_polarized:
        powers = [
            reflectance(cosine, index) if coat is None else beneath_reflectance(cosine, coat, index)
            for index, cosine in channels
        ]
        return material.channels(powers) * visible
    light = LightPath.of(pair, mode)
    matrices = [mirror(light.pair, cosine, index, coat) for index, cosine in channels]
    return mi.Spectrum(visible) * light.mueller(matrices)


def _side_by_side(indices: list[Number], others: list[Any]) -> list[tuple[Number, Any]]:
    """Return pairs of each channel, where either list may hold one value for all."""
    count = max(len(indices), len(others))
    both = (values * count if len(values) == 1 else values for values in (indices, others))
    return list(zip(*both, strict=True))


@dataclass(frozen=True)
class LightPath:
    """Light along −ω0, then along ω, for Jones matrices.

    Attributes
    ----------
    pair : geometry at the structure.
    ends : directions of travel outside.
    above : whether light stays above the surface.
    passed : a coat's face at both ends; empty without a coat.
    """

    pair: Geometry
    ends: tuple[Vector3f, Vector3f]
    above: bool
    passed: tuple[FaceCoefficients, ...]

    @classmethod
    def of(cls, pair: Pair, mode: mi.TransportMode) -> LightPath:
        """Return the path of light of a pair; unpolarised light knows no direction."""
        outer = pair.outer
        inner = [(w.x, w.y, cosine) for w, cosine in ((pair.wi, pair.cos_i), (pair.wo, pair.cos_o))]
        ends, cosines = [outer.wi, outer.wo], [outer.cos_i, outer.cos_o]
        if mode != mi.TransportMode.Importance:
            inner, ends, cosines = inner[::-1], ends[::-1], cosines[::-1]
        passed: tuple[FaceCoefficients, ...] = ()
        if isinstance(pair, CoatedPair):
            passed = tuple(crossing(cosine, pair.n) for cosine in cosines)
        side = mi.Vector3f(1.0, 1.0, 1.0 if outer.above else -1.0)
        travel = -ends[0] * side, ends[1] * side
        return cls(geometry(*inner), travel, outer.above, passed)

    def mueller(self, matrices: list[Jones]) -> Spectrum:
        """Return Mueller matrices between Mitsuba's bases, per channel."""
        if not self.above:  # turned over, p points the other way
            matrices = [(ss, -sp, -ps, pp) for ss, sp, ps, pp in matrices]
        return mueller(matrices, self.ends, polarisation_axes(*self.ends))


def polarisation_axes(came: Vector3f, left: Vector3f) -> tuple[Vector3f, Vector3f]:
    """Return the axes s of light along two directions (`optics.boundary`)."""
    axes = []
    for direction in (came, left):
        square = dr.square(direction.x) + dr.square(direction.y)
        slanted = square > SAME_DIRECTION
        inverse = dr.rsqrt(dr.select(slanted, square, 1.0))
        axes.append((slanted, mi.Vector3f(-direction.y * inverse, direction.x * inverse, 0.0)))
    (is_came, s_came), (is_left, s_left) = axes
    s_came = dr.select(is_came, s_came, dr.select(is_left, s_left, mi.Vector3f(0.0, 1.0, 0.0)))
    return s_came, dr.select(is_left, s_left, s_came)


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
    """Return the sixteen entries, row by row (`reference.boundary.mueller`)."""
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
    """Return x y*. `dr.conj` returns a Python complex number as it is."""
    return x * of(y).complex(y.real, -y.imag) if is_complex(x) else x * y
