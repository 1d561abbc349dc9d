"""Lobes of solved orders in RGB variants: summed over daylight in kernels (`daylight`)."""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...optics.colour import RGB_WAVELENGTHS
from ...optics.mirror import horizon_correction
from ...optics.orders import lobe_falloff, lobe_peak, wavenumber_step
from ...plugin.arithmetic import clip, index_of, maximum, minimum
from ...plugin.directions import Pair
from ...plugin.loops import sum_of
from ...plugin.memory import index_between, read_record, upload
from ...plugin.sampling import invert
from ...plugin.types import Colour, Context, Float, Index, Interaction, Vector2f
from ..daylight import CHANNELS, ENDS, daylight_weights
from ..lookup import corner_weights, weighted
from .lobes import MIN_SUM, REACH, Below, Draw, OrderLobe, wavenumber_of

#: Tangential part and cosine of ωi, in the patch's frame.
Incidence = tuple[Vector2f, Float]


class DaylightLobes:
    """Lobes of RGB variants, summed over daylight (`daylight`)."""

    def __init__(self, window: OrderLobe) -> None:
        self._window, self.lookup = window, window.lookup
        self.sigma, self.period = window.sigma, window.period
        weights = daylight_weights(self.sigma, self.period)
        self.waves, self._variances = weights.waves, weights.variances
        rows = weights.smoothed.astype("float32")
        self._counts = rows.shape[0] - 1, rows.shape[1] - 1
        corners = [rows[a : a - 1 or None, b : b - 1 or None] for a in (0, 1) for b in (0, 1)]
        self._smoothed = upload(mi.Float, np.concatenate(corners, axis=-1))
        order_0 = np.column_stack([weights.order_0, weights.wavelengths])
        self._order_0 = upload(mi.Float, np.pad(order_0, ((0, 0), (0, 3))).astype("float32"))
        self._wavelengths = len(order_0)
        self._bins = len(weights.cumulative) - 1
        self._cumulative = upload(mi.Float, weights.cumulative.astype("float32"))

    def reflected(
        self, pair: Pair, si: Interaction, below: Below, ctx: Context
    ) -> tuple[Colour, Float]:
        """See `SpectralLobes.reflected`."""
        radius = dr.squared_norm(pair.uv)
        light = pair.incident, pair.cos_i
        total = self._zeroth(light, below, radius, pair)
        others = self.others(light, below, pair.uv, radius)
        total = [a + b for a, b in zip(total, others, strict=True)]
        *colours, density = (part * pair.cos_o for part in total)
        return mi.Color3f(*colours), dr.detach(density)

    def draw(
        self, incident: Vector2f, cos_i: Float, si: Interaction, sample1: Float, sample2: Vector2f
    ) -> Draw:
        """See `SpectralLobes.draw`: by a wavelength of daylight."""
        # the place in its bin draws the order, a number of its own the place of the wavelength
        bin_, rest = invert(self._cumulative, mi.UInt32(0), self._bins, self._bins, sample1)
        step = (ENDS[1] - ENDS[0]) / self._bins
        fine = rest * 64.0
        place = index_between(dr.floor(fine), 0.0, 63.0)
        wavelength = dr.fma(mi.Float(bin_) + (place + 0.5) * (1.0 / 64.0), step, ENDS[0])
        row = self.lookup.row(*incident, cos_i, wavelength)
        return self._window.drawn(row, wavelength, fine - place, sample2)

    def albedo(self, incident: Vector2f, cos_i: Float, si: Interaction) -> Colour:
        """See `SpectralLobes.albedo`; of the wavelength that is a channel's mean."""
        rows = [self.lookup.row(*incident, cos_i, mi.Float(lam)) for lam in RGB_WAVELENGTHS]
        return mi.Color3f(*(self.lookup.total(row) for row in rows))

    def shares(
        self, light: Incidence, below: Below, wavelength: Float, order: Any
    ) -> tuple[Float, Float]:
        """Return the efficiency of an order, and its probability."""
        incident, cos_i = light
        row = self.lookup.row(*incident, cos_i, wavelength)
        share, total = self.lookup.share(row, order, True, below), self.lookup.total(row)
        return share.efficiency, share.chance * dr.rcp(maximum(total, MIN_SUM))

    def _zeroth(self, light: Incidence, below: Below, radius: Float, pair: Pair) -> list[Float]:
        """Sum order 0 over wavelengths, for red, green, blue and the density."""
        longest = dr.square(2e3 * math.pi * self.sigma / ENDS[1])
        count = dr.select(radius * longest < REACH, mi.UInt32(self._wavelengths), mi.UInt32(0))

        def add(n: Index, inputs: tuple[Incidence, list[Float]], sums: list[Float]) -> list[Float]:
            light, (radius, into, out) = inputs
            node = read_record(self._order_0, n, 8)
            k = wavenumber_of(node[CHANNELS])
            peak = lobe_peak(k, self.sigma)
            value, share = self.shares(light, below, node[CHANNELS], self._window.mirrored())
            lobe = peak * dr.exp(-math.pi * radius * peak)
            return added(sums, node, lobe, value * horizon_correction(into, out, k), share)

        levels = [dr.square(cosine) * self.sigma for cosine in (pair.cos_i, pair.cos_o)]
        return sum_of(count, add, (light, [radius, *levels]), [mi.Float(0.0)] * CHANNELS)

    def others(self, light: Incidence, below: Below, uv: Vector2f, radius: Float) -> list[Float]:
        """Sum all other orders, for red, green, blue and the density."""
        if self._window.crossed:
            return self._others_of_pairs(light, below, uv, radius)
        u, v = uv.x, uv.y
        unit = 2.0 * math.pi / self.period
        square = maximum(radius, 1e-8)
        # k_m = m · step, of the sign of u
        step = wavenumber_step(u, v, self.period)
        aside = lobe_falloff(u, v, self.sigma, self.period)
        first = maximum(dr.ceil(self.waves[0] * dr.rcp(step)), 1.0)
        last = minimum(
            dr.floor(self.waves[1] * dr.rcp(step)),
            dr.sqrt(REACH * dr.rcp(maximum(aside, 1e-8))),
        )
        most = int(2.0 * self.lookup.index * self.waves[1] / unit) + 1
        lit = (last >= first) & (radius * (self.waves[1] / unit) ** 2 > 0.25)
        count = dr.select(lit, index_of(index_between(last - first + 1.0, 0.0, float(most))), 0)
        variance, scale = self.smoothing(square)

        def add(n: Index, inputs: tuple[Incidence, list[Float]], sums: list[Float]) -> list[Float]:
            light, (step, aside, variance, scale) = inputs
            m = first + mi.Float(n)
            k = m * step
            weights = self.weights(k, variance)
            wavelength = 2e3 * math.pi * dr.rcp(k)
            value, share = self.shares(light, below, wavelength, dr.mulsign(m, u))
            lobe = scale * dr.exp(-aside * dr.square(m))
            return added(sums, weights, lobe, value, share)

        inputs = light, [step, aside, variance, scale]
        return sum_of(count, add, inputs, [mi.Float(0.0)] * CHANNELS)

    def _others_of_pairs(
        self, light: Incidence, below: Below, uv: Vector2f, radius: Float
    ) -> list[Float]:
        """Sum the orders of a crossed grating but (0, 0), each where it is largest.

        With q_m = 2π (m_x/d_x, m_y/d_y): k_m = q_m·(u, v)/ρ², and the lobe is smaller by
        exp(−σ² (q_m × (u, v))²/ρ²).
        """
        square = maximum(radius, 1e-8)
        variance, scale = self.smoothing(square)
        units = [2.0 * math.pi / period for period in self._window.periods]
        first, last = self.waves

        def add(n: Index, inputs: tuple[Incidence, list[Float]], sums: list[Float]) -> list[Float]:
            light, (u, v, square, variance, scale) = inputs
            order = mi.Vector2f(*self.lookup.order_of_port(n))
            q_x, q_y = order.x * units[0], order.y * units[1]
            k = (q_x * u + q_y * v) * dr.rcp(square)
            aside = dr.square(self.sigma * (q_x * v - q_y * u)) * dr.rcp(square)
            lit = (k > first) & (k < last) & (aside < REACH)
            k = dr.select(lit, k, last)
            weights = self.weights(k, variance)
            value, share = self.shares(light, below, 2e3 * math.pi * dr.rcp(k), order)
            lobe = dr.select(lit, scale * dr.exp(-aside), 0.0)
            return added(sums, weights, lobe, value, share)

        inputs = light, [uv.x, uv.y, square, variance, scale]
        return sum_of(self.lookup.count, add, inputs, [mi.Float(0.0)] * CHANNELS)

    def smoothing(self, square: Float) -> tuple[Float, Float]:
        """Return the variance of `weights`, and the scale of lobes, for u² + v²."""
        scale = self.sigma * dr.rsqrt(square) * (1.0 / math.sqrt(math.pi))
        return dr.rcp(square) * (0.5 / self.sigma**2), scale

    def weights(self, k: Float, variance: Float) -> list[Float]:
        """Interpolate the smoothed weights of a wavenumber."""
        ends = zip((variance, k), (self._variances, self.waves), strict=True)
        places = [clip((x - low) * (1.0 / (high - low)), 0.0, 1.0) for x, (low, high) in ends]
        cell, shares = corner_weights(places, self._counts, 1.0)
        values = read_record(self._smoothed, cell, 4 * CHANNELS)
        return [weighted(shares, values[c::CHANNELS]) for c in range(CHANNELS)]


def added(
    sums: list[Float], weights: list[Float], lobe: Float, value: Float, share: Float
) -> list[Float]:
    """Add a term to red, green, blue (by its efficiency) and the density (by its probability)."""
    *colours, density = sums
    light = lobe * value
    added = [dr.fma(w, light, total) for w, total in zip(weights, colours, strict=False)]
    return [*added, dr.fma(weights[CHANNELS - 1], lobe * share, density)]
