"""What a variant of Mitsuba knows of a wavelength: four of them a ray, a fixed one, or colours.

The BSDF asks for two things here, the diffracted power in the variant's own channels and a density
to draw directions from, and is the same for all variants otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from ..tables.table import DiffractionTable
from .lookup import device_table
from .rgb_power import Colours, rgb_light
from .sampling import order_sampler


class Wavelengths:
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
        self._fixed = mi.Float(wavelength)
        dr.make_opaque(self._fixed)

    def power(self, uv: Any, scaled_w: Any, si: Any) -> Any:
        """⟨|P|²⟩ / (4π²σ⁴ λ²) in 1/µm² per channel, mi.UnpolarizedSpectrum.

        uv : tangential part of ωi + ωo in the patch's frame.
        scaled_w : normal part times height_scale.
        """

        def of_wavelength(wavelength: Any) -> Any:
            k = dr.rcp(wavelength) * (2e3 * dr.pi)
            power = self.device.window_sum(k * uv.x, k * uv.y, k * scaled_w)
            return power * dr.square(k * (0.5 / dr.pi))

        wavelengths = self._wavelengths(si)
        return mi.UnpolarizedSpectrum(
            _each(of_wavelength, wavelengths, dr.grad_enabled(uv, scaled_w))
        )

    def density(
        self, uv: Any, folded: Any, cos_i: Any, cos_o: Any, height_scale: Any, si: Any
    ) -> Any:
        """Density per solid angle of an ωo that `draw` gives with its uv, or with `folded`.

        folded : the ωi + ωo beyond the horizon which `sampling.fold` makes the same ωo of.
        """

        def of_wavelength(wavelength: Any) -> Any:
            k = dr.rcp(wavelength) * (2e3 * dr.pi)
            strategy = self._sampler.strategy(k, cos_i, height_scale)
            direct = self._sampler.density(k * uv.x, k * uv.y, *strategy)
            beyond = self._sampler.density(k * folded.x, k * folded.y, *strategy)
            return dr.fma(direct, cos_o, 0.5 * beyond) * dr.square(k)

        wavelengths = self._wavelengths(si)
        densities = _each(of_wavelength, wavelengths, dr.grad_enabled(uv, cos_i, cos_o))
        return sum(densities, mi.Float(0.0)) * (1.0 / len(densities))

    def draw(self, cos_i: Any, height_scale: Any, sample1: Any, sample2: Any, si: Any) -> Any:
        """The tangential part of an ωi + ωo in the patch's frame, for a wavelength drawn too.

        sample1 : 0 … 1, uniform.
        """
        wavelengths = self._wavelengths(si)
        count = len(wavelengths)
        hero = dr.clip(mi.UInt32(sample1 * count), 0, count - 1)
        wavelength = wavelengths[0]
        for n in range(1, count):
            wavelength = dr.select(hero == n, wavelengths[n], wavelength)
        k = dr.rcp(wavelength) * (2e3 * dr.pi)
        remaining = sample1 * count - hero
        return self._sampler.draw(k, cos_i, height_scale, remaining, sample2) * dr.rcp(k)

    def _wavelengths(self, si: Any) -> list[Any]:
        if not mi.is_spectral:
            return [self._fixed]
        return [si.wavelengths[n] for n in range(len(si.wavelengths))]


def variant_light(table: DiffractionTable, wavelength: float) -> Wavelengths | Colours:
    """The light of the current variant."""
    if mi.is_rgb:
        return rgb_light(table)
    return Wavelengths(table, wavelength)


def _each(function: Callable[[Any], Any], inputs: list[Any], differentiable: bool) -> list[Any]:
    """function(λ) for each wavelength: in a loop, which makes a smaller and faster kernel.

    Derivatives do not flow through loops without further ado, so then it is unrolled; so it is
    where there is no kernel.
    """
    if differentiable or len(inputs) == 1 or not dr.is_jit_v(mi.Float):
        return [function(wavelength) for wavelength in inputs]

    def body(n: Any, inputs: list[Any], outputs: list[Any]) -> tuple[Any, list[Any], list[Any]]:
        result = function(inputs[0])
        return n + 1, [*inputs[1:], inputs[0]], [*outputs[1:], result]

    state = (mi.UInt32(0), inputs, [mi.Float(0.0) for _ in inputs])
    return dr.while_loop(state, lambda n, *_: n < len(inputs), body)[2]
