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
from .crossing import Crossing
from .pair import Pair, Place
from .restricted import device_table
from .rgb_power import rgb_power
from .roles import Colour, Float, Interaction, Vector2f
from .sampling import folded_cosine, order_sampler


class PowerModel(Protocol):
    """What the BSDF asks of the diffracted power."""

    def power(self, pair: Pair | Place, height_scale: Float, si: Interaction) -> Colour:
        """⟨|P|²⟩ / (4π²σ⁴ λ²) in 1/µm², per channel."""

    def density(self, pair: Pair | Crossing, height_scale: Float, si: Interaction) -> Float:
        """Density per solid angle of drawing ωo: by `draw`, then `sampling.fold`."""

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

    def power(self, pair: Pair | Place, height_scale: Float, si: Interaction) -> Colour:
        """See `PowerModel.power`."""
        scaled_w = pair.w * height_scale

        def of_wavelength(k: Float) -> Float:
            found = self.device.window_sum(k * pair.uv.x, k * pair.uv.y, k * scaled_w)
            return found * dr.square(k * (0.5 / dr.pi))

        differentiable = dr.grad_enabled(pair.uv, scaled_w)
        return mi.UnpolarizedSpectrum(self._each(of_wavelength, si, differentiable))

    def density(self, pair: Pair | Crossing, height_scale: Float, si: Interaction) -> Float:
        """See `PowerModel.density`; the mean of all wavelengths'."""
        folded, cos_folded = pair.folded, folded_cosine(pair.cos_o)  # the same at all

        def of_wavelength(k: Float) -> Float:
            strategy = self._sampler.strategy(k, pair.cos_i, dr.detach(height_scale))
            direct = self._sampler.density(k * pair.uv, *strategy)
            beyond = self._sampler.density(k * folded, *strategy, cos_folded > 0.0)
            return dr.fma(direct, pair.cos_o, cos_folded * beyond) * dr.square(k)

        differentiable = dr.grad_enabled(pair.uv, pair.cos_i, pair.cos_o)
        found = self._each(of_wavelength, si, differentiable)
        return sum(found[1:], found[0]) * (1.0 / len(found))

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

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if not mi.is_spectral:
            return [self._fixed]
        return [si.wavelengths[n] for n in range(len(si.wavelengths))]

    def _each(
        self, function: Callable[[Float], Float], si: Interaction, differentiable: bool
    ) -> list[Float]:
        """function(k) for each wavelength.

        In a loop, which makes a smaller and faster kernel. Derivatives do not flow through loops
        without further ado, so then it is unrolled; so it is where there is no kernel.
        """
        wavenumbers = self.wavenumbers(si)
        count = len(wavenumbers)
        if differentiable or count == 1 or not dr.is_jit_v(mi.Float):
            return [function(k) for k in wavenumbers]

        def body(
            n: Float, inputs: list[Float], found: list[Float]
        ) -> tuple[Float, list[Float], list[Float]]:
            return n + 1, [*inputs[1:], inputs[0]], [*found[1:], function(inputs[0])]

        state = (mi.UInt32(0), wavenumbers, [mi.Float(0.0) for _ in wavenumbers])
        return list(dr.while_loop(state, lambda n, *_: n < count, body)[2])


def power_model(table: DiffractionTable, wavelength: float) -> PowerModel:
    """That of the current variant."""
    return rgb_power(table) if mi.is_rgb else SpectralPower(table, wavelength)
