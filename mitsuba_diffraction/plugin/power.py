"""The diffracted power in a variant's own channels, and a density to draw directions from.

The BSDF asks for these two, and is the same for all variants otherwise. This is the model of
variants with wavelengths, `rgb_power` that of variants with colours.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import drjit as dr
import mitsuba as mi

from ..tables.table import DiffractionTable
from .pair import Pair
from .restricted import device_table
from .rgb_power import rgb_power
from .roles import Colour, Float, Interaction, Vector2f
from .sampling import order_sampler


class PowerModel(Protocol):
    """What the BSDF asks of the diffracted power."""

    def power(self, pair: Pair, height_scale: Float, si: Interaction) -> Colour:
        """⟨|P|²⟩ / (4π²σ⁴ λ²) in 1/µm², per channel."""

    def density(self, pair: Pair, height_scale: Float, si: Interaction) -> Float:
        """Density per solid angle of drawing ωo: by `draw`, then `sampling.fold`."""

    def power_and_density(
        self, pair: Pair, height_scale: Float, si: Interaction
    ) -> tuple[Colour, Float]:
        """Both at once."""

    def wavenumbers(self, si: Interaction) -> list[Float]:
        """2π/λ of each channel, rad/µm."""

    def flat(self, pair: Pair, si: Interaction) -> Colour:
        """What `power` is of a flat surface."""

    def draw(
        self, cos_i: Float, height_scale: Float, sample1: Float, sample2: Vector2f, si: Interaction
    ) -> Vector2f:
        """The tangential part of an ωi + ωo in the patch's frame, from three uniform numbers."""


class SpectralPower:
    """Spectral variants, whose rays carry wavelengths, and mono variants, which have one for all.

    Parameters
    ----------
    table : the diffraction table.
    wavelength : nm, for mono variants.

    Attributes
    ----------
    device : the table in the variant's memory.
    """

    def __init__(self, table: DiffractionTable, wavelength: float) -> None:
        self.device = device_table(table)
        self._sampler = order_sampler(table)
        self._sigma = table.sigma
        self._fixed = mi.Float(wavelength)
        dr.make_opaque(self._fixed)

    def power(self, pair: Pair, height_scale: Float, si: Interaction) -> Colour:
        """See `PowerModel.power`."""
        scaled_w = pair.w * height_scale

        def of_wavelength(k: Float) -> tuple[Float, Float]:
            return self._power(k, pair, scaled_w), mi.Float(0.0)

        differentiable = dr.grad_enabled(pair.uv, scaled_w)
        return mi.UnpolarizedSpectrum(self._each(of_wavelength, si, differentiable)[0])

    def density(self, pair: Pair, height_scale: Float, si: Interaction) -> Float:
        """See `PowerModel.density`; the mean of all wavelengths'."""

        def of_wavelength(k: Float) -> tuple[Float, Float]:
            return mi.Float(0.0), self._density(k, pair, height_scale)

        differentiable = dr.grad_enabled(pair.uv, pair.cos_i, pair.cos_o)
        return self._each(of_wavelength, si, differentiable)[1]

    def power_and_density(
        self, pair: Pair, height_scale: Float, si: Interaction
    ) -> tuple[Colour, Float]:
        """See `PowerModel.power_and_density`."""
        scaled_w = pair.w * height_scale

        def of_wavelength(k: Float) -> tuple[Float, Float]:
            return self._power(k, pair, scaled_w), self._density(k, pair, height_scale)

        differentiable = dr.grad_enabled(pair.uv, scaled_w, pair.cos_i, pair.cos_o)
        powers, density = self._each(of_wavelength, si, differentiable)
        return mi.UnpolarizedSpectrum(powers), density

    def draw(
        self, cos_i: Float, height_scale: Float, sample1: Float, sample2: Vector2f, si: Interaction
    ) -> Vector2f:
        """See `PowerModel.draw`; for a wavelength that is drawn too."""
        wavelengths = self._wavelengths(si)
        count = len(wavelengths)
        hero = dr.clip(mi.UInt32(sample1 * count), 0, count - 1)
        wavelength = wavelengths[0]
        for n in range(1, count):
            wavelength = dr.select(hero == n, wavelengths[n], wavelength)
        k = dr.rcp(wavelength) * (2e3 * dr.pi)
        remaining = sample1 * count - hero
        return self._sampler.draw(k, cos_i, height_scale, remaining, sample2) * dr.rcp(k)

    def wavenumbers(self, si: Interaction) -> list[Float]:
        """See `PowerModel.wavenumbers`."""
        return [dr.rcp(wavelength) * (2e3 * dr.pi) for wavelength in self._wavelengths(si)]

    def flat(self, pair: Pair, si: Interaction) -> Colour:
        """See `PowerModel.flat`: exp(−σ²k²|(u, v)|²)/λ²."""
        apart = -(self._sigma**2) * dr.squared_norm(pair.uv)
        squares = [dr.square(k) for k in self.wavenumbers(si)]
        return mi.UnpolarizedSpectrum(
            [dr.exp(apart * square) * (square * (0.5 / dr.pi) ** 2) for square in squares]
        )

    def _power(self, k: Float, pair: Pair, scaled_w: Float) -> Float:
        power = self.device.window_sum(k * pair.uv.x, k * pair.uv.y, k * scaled_w)
        return power * dr.square(k * (0.5 / dr.pi))

    def _density(self, k: Float, pair: Pair, height_scale: Float) -> Float:
        strategy = self._sampler.strategy(k, pair.cos_i, dr.detach(height_scale))
        direct = self._sampler.density(k * pair.uv.x, k * pair.uv.y, *strategy)
        beyond = self._sampler.density(k * pair.folded.x, k * pair.folded.y, *strategy)
        return dr.fma(direct, pair.cos_o, 0.5 * beyond) * dr.square(k)

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if not mi.is_spectral:
            return [self._fixed]
        return [si.wavelengths[n] for n in range(len(si.wavelengths))]

    def _each(
        self,
        function: Callable[[Float], tuple[Float, Float]],
        si: Interaction,
        differentiable: bool,
    ) -> tuple[list[Float], Float]:
        """What function(k) gives first for each wavelength, and the mean of what it gives second.

        In a loop, which makes a smaller and faster kernel. Derivatives do not flow through loops
        without further ado, so then it is unrolled; so it is where there is no kernel.
        """
        wavenumbers = self.wavenumbers(si)
        count = len(wavenumbers)
        first, second = [mi.Float(0.0)] * count, mi.Float(0.0)
        if differentiable or count == 1 or not dr.is_jit_v(mi.Float):
            for n, k in enumerate(wavenumbers):
                first[n], more = function(k)
                second = second + more
            return first, second * (1.0 / count)

        def body(
            n: Float, inputs: list[Float], first: list[Float], second: Float
        ) -> tuple[Float, list[Float], list[Float], Float]:
            value, more = function(inputs[0])
            return n + 1, [*inputs[1:], inputs[0]], [*first[1:], value], second + more

        first = [mi.Float(0.0) for _ in first]
        state = (mi.UInt32(0), wavenumbers, first, second)
        _, _, first, second = dr.while_loop(state, lambda n, *_: n < count, body)
        return first, second * (1.0 / count)


def power_model(table: DiffractionTable, wavelength: float) -> PowerModel:
    """That of the current variant."""
    return rgb_power(table) if mi.is_rgb else SpectralPower(table, wavelength)
