"""The diffracted power in a variant's own channels, and a density to draw directions from.

All else in the BSDF is the same for every variant. `SpectralPower` serves variants with
wavelengths, `rgb_power` those with colours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import drjit as dr
import mitsuba as mi

from ..optics.geometry import wavenumber
from ..tables import DiffractionTable
from .device_table import DeviceTable, device_table
from .directions import Pair, PairThrough
from .height_derivatives import DifferentiableHeights
from .rgb import RGBPower, rgb_power
from .sampling import order_sampler
from .types import Colour, Float, Index, Interaction, Mask, Powers, Vector2f
from .window_positions import PlacedWindow, WindowPositions

#: A function of 2π/λ, rad/µm.
PerWavenumber = Callable[[Float], list[Float]]


class SpectralPower:
    """Spectral variants, whose rays carry wavelengths, and mono variants, which have one for all.

    Parameters
    ----------
    table : the diffraction table.
    wavelength : nm, for mono variants.
    places : positions of windows; None for the table's own window.
    heights : that derivatives are wanted by, or None.

    device : the table in the variant's memory.
    """

    def __init__(
        self,
        table: DiffractionTable,
        wavelength: float,
        places: WindowPositions | None = None,
        heights: DifferentiableHeights | None = None,
    ) -> None:
        self.device = device_table(table) if heights is None else DeviceTable(table, heights)
        self._places, self._parts = places, 3 if self.device.grid.coherent else 2
        self._sampler = order_sampler(table if places is None else table.averaged)
        self._sigma_0, self._ratio = table.sigma_0, table.order_0_ratio
        # to rounding
        shortest, longest = table.wavelength_range
        self._served = float(wavenumber(shortest)) * (1.0 + 1e-5)
        self._bounds = shortest * (1.0 - 2e-5), longest
        self._fixed = mi.Float(wavelength)
        dr.make_opaque(self._fixed)

    def answers(
        self,
        pair: Pair | PairThrough,
        height_scale: Float,
        drawing_scale: Float,
        si: Interaction,
        kinds: str,
    ) -> tuple[Powers, Float]:
        """Return power and density of a pair, those asked for; zero where not.

        "v" asks for ⟨|P|²⟩ / (4π²σ⁴ λ²) in 1/µm², per channel; "d" for the density of `draw` per
        solid angle, outside of a coat, the mean over wavelengths.

        drawing_scale : factor on heights that directions are drawn for.
        """
        # the density first: the look-up of power evicts its small tables from the cache
        asked = [self._density(pair.outer, drawing_scale)] if "d" in kinds else []
        asked += [self._power(pair, height_scale, si)] if "v" in kinds else []
        numbers = ("d" in kinds) + ("v" in kinds) * self._parts
        found = self._each(
            lambda k: [x for each in asked for x in each(k)], numbers, si, pair, height_scale
        )
        nothing = mi.UnpolarizedSpectrum(0.0)
        power, density = Powers(nothing, nothing), mi.Float(0.0)
        if "v" in kinds:
            parts = zip(*(values[-self._parts :] for values in found), strict=True)
            power = Powers(*(mi.UnpolarizedSpectrum(list(part)) for part in parts))
        if "d" in kinds:
            first, *others = [values[0] for values in found]
            density = sum(others, first) * (1.0 / len(found))
        return power, density

    def _power(
        self, pair: Pair | PairThrough, height_scale: Float, si: Interaction
    ) -> PerWavenumber:
        """Return a function that computes the values of `Powers`."""
        uv, w = pair.place
        scaled_w = w * height_scale
        if self._places is None or not isinstance(pair, Pair):
            windows: Sequence[PlacedWindow] = ()
        else:
            windows = self._places.at(si, pair.frame)

        def of_wavelength(k: Float) -> list[Float]:
            sums = self.device.window_sums(k * uv.x, k * uv.y, k * scaled_w, windows)
            unit, serves = dr.square(k * (0.5 / dr.pi)), self._serves(k)
            return [*(dr.select(serves, each * unit, 0.0) for each in sums[:2]), *sums[2:]]

        return of_wavelength

    def _density(self, pair: Pair | PairThrough, height_scale: Float) -> PerWavenumber:
        def of_wavelength(k: Float) -> list[Float]:
            strategy = self._sampler.strategies.at(k * dr.detach(height_scale), pair.cos_i)
            density = self._sampler.density(k * pair.uv, strategy)
            return [density * pair.cos_o * pair.frame.area * dr.square(k)]

        return of_wavelength

    def draw(
        self, cos_i: Float, height_scale: Float, sample1: Float, sample2: Vector2f, si: Interaction
    ) -> Vector2f:
        """Draw (u, v) of an ωi + ωo in the coordinates of the table, by three uniform numbers.

        The wavelength to draw for is random, too.
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

    def wavenumbers(self, si: Interaction) -> list[Float]:
        """Return 2π/λ of each channel, rad/µm."""
        return [dr.rcp(wavelength) * (2e3 * dr.pi) for wavelength in self._wavelengths(si)]

    def flat(self, pair: Pair, si: Interaction) -> Colour:
        """Return `power` of a flat surface, (σ₀/σ)² exp(−σ₀²k²|(u, v)|²)/λ²."""
        apart = -(self._sigma_0**2) * dr.squared_norm(pair.uv)
        peak = self._ratio * (0.5 / dr.pi) ** 2
        squares = [dr.select(self._serves(k), dr.square(k), 0.0) for k in self.wavenumbers(si)]
        return mi.UnpolarizedSpectrum(
            [dr.exp(apart * square) * (square * peak) for square in squares]
        )

    def bounded(self, si: Interaction) -> Interaction:
        """Return the interaction with wavelengths within the table's.

        Longer waves have all values of the longest one, energy too; shorter ones have no power, as
        the table lacks their frequencies.
        """
        if not mi.is_spectral:
            return si
        known = mi.SurfaceInteraction3f(si)
        known.wavelengths = dr.clip(si.wavelengths, *self._bounds)
        return known

    def _serves(self, k: Float) -> Mask:
        """Whether the table is of light of this 2π/λ."""
        return k <= self._served

    def _wavelengths(self, si: Interaction) -> list[Float]:
        if not mi.is_spectral:
            return [self._fixed]
        return [si.wavelengths[n] for n in range(len(si.wavelengths))]

    def _each(
        self,
        function: PerWavenumber,
        values: int,
        si: Interaction,
        pair: Pair | PairThrough,
        scale: Float,
    ) -> list[list[Float]]:
        """Evaluate a function that returns so many values at each wavelength.

        A loop over wavelengths makes a smaller and faster kernel. It is unrolled where derivatives
        are wanted, which do not pass such loops, and in scalar variants, which have no kernel.
        """
        wavenumbers = self.wavenumbers(si)
        count = len(wavenumbers)
        differentiable = dr.grad_enabled(pair.uv, pair.w, pair.cos_i, pair.cos_o, scale)
        if differentiable or self.device.differentiable or count == 1 or not dr.is_jit_v(mi.Float):
            return [function(k) for k in wavenumbers]

        def body(
            n: Index, inputs: list[Float], found: list[list[Float]]
        ) -> tuple[Index, list[Float], list[list[Float]]]:
            return n + 1, [*inputs[1:], inputs[0]], [*found[1:], function(inputs[0])]

        nothing = [[mi.Float(0.0) for _ in range(values)] for _ in wavenumbers]
        state = (mi.UInt32(0), wavenumbers, nothing)
        # inactive lanes end at once: vectors without an active one skip the look-ups
        asked = mi.Mask(pair.asked)
        loop = dr.while_loop(state, lambda n, *_: (n < count) & asked, body)
        return list(loop[2])


#: Diffracted power in a variant's channels, and a density to draw directions from.
PowerModel = SpectralPower | RGBPower


def power_model(
    table: DiffractionTable,
    wavelength: float,
    places: WindowPositions | None = None,
    heights: DifferentiableHeights | None = None,
) -> PowerModel:
    """Make the model of the current variant; RGB variants know no `places` and no `heights`."""
    return rgb_power(table) if mi.is_rgb else SpectralPower(table, wavelength, places, heights)
