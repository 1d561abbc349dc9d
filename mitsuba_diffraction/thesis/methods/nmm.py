"""The thesis' n_min–n_max method: only wavelengths whose orders reach the view direction."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.geometry import diffraction_coordinates, wavenumber
from ...tables.build.spectrum import NEAR
from .method import Array, FullSpectrum, Method

WEIGHTS = ("step", "lobe")

#: nm, whose value the white around the mirror direction takes: where the eye sees best.
SPECULAR_WAVELENGTH = 555.0


class OrdersOnly(Method):
    """`nmm`: S of `flss`, at the wavelengths λₙ = d·|u|/n (and d·|v|/n) alone.

    For a direction pair with (u, v, w) = ωi + ωo (thesis, "NMM approach", with the period d
    where one draft has the pixel size):

    1. Where hypot(u, v) < ε the colour is white, as bright as at 555 nm: near the mirror direction
       n_min…n_max holds too few wavelengths or none. ε = 3/(σ k(λ_max)) by default, where order
       0's lobe ends at the longest wavelength.
    2. Elsewhere, for n from n_min = ⌈d|u|/λ_max⌉ (at least 1) to n_max = ⌊d|u|/λ_min⌋, every
       λₙ = d|u|/n adds f(λₙ)·s̄(λₙ)·Δλₙ; likewise for v where there is a period along y. A
       wavelength that both reach is added twice, as in the thesis.

    `weights` says what Δλₙ is. "step", the thesis' own, is the step of the full sum (5 nm) for
    every wavelength alike: since the λₙ lie closer together, and their lobes are narrower, the
    shorter they are, the sum is too blue, and red is lost: the known purple shift. "lobe" is
    ∫exp(−σ²(k·u − 2πn/d)²)dλ = λₙ²/(2√π·σ·|u|), the width in wavelength of the lobe that a perfect
    grating puts there; it is right where the lobe of one order does not reach the next.

    Between orders, and wherever the surface is not periodic, light is missed: `brdf` and `relative`
    are those of `flss` within half a step of a λₙ and around the mirror direction, and 0 elsewhere.

    Parameters
    ----------
    full : the method to sample, its table above all.
    periods : (dx, dy) in µm, `None` where there is none along an axis, not both.
    weights : "step" or "lobe".
    specular : ε, or `None` for the default.
    """

    def __init__(
        self,
        full: FullSpectrum,
        periods: tuple[float | None, float | None],
        *,
        weights: str = "step",
        specular: float | None = None,
        name: str = "nmm",
    ) -> None:
        if weights not in WEIGHTS:
            raise DiffractionError(
                f"weights='{weights}' is unknown; choose one of {', '.join(WEIGHTS)}"
            )
        if periods[0] is None and periods[1] is None:
            raise DiffractionError("method 'nmm' needs a period along x or y; give one in µm")
        self.name, self.full, self.periods, self.weighting = name, full, periods, weights
        self.sigma, self.wavelength_range = full.sigma, full.wavelength_range
        longest = float(wavenumber(full.wavelength_range[1]))
        self.specular = NEAR / (full.sigma * longest) if specular is None else specular
        if not 0.0 <= self.specular < 2.0:
            raise DiffractionError(f"specular={self.specular:g} must be at least 0 and below 2")
        self._step = float(np.diff(full.wavelengths).max())

    def window_sum(self, wi: Array, wo: Array, wavelength: Array) -> Array:
        """S as `flss` has it, at wavelengths that are taken, and 0 at others."""
        taken = self._takes(wi, wo, wavelength)
        result = np.zeros(len(wi))
        result[taken] = self.full.window_sum(wi[taken], wo[taken], wavelength[taken])
        return result

    def special(self, wi: Array, wo: Array) -> tuple[NDArray[np.bool_], float]:
        """White within ε of the mirror direction."""
        u, v, _ = diffraction_coordinates(wi, wo)
        return np.hypot(u, v) < self.specular, SPECULAR_WAVELENGTH

    def samples(self, wi: Array, wo: Array) -> Iterator[tuple[Array, Array]]:
        """λₙ and Δλₙ, order by order, first along x and then along y."""
        u, v, _ = diffraction_coordinates(wi, wo)
        low, high = self.wavelength_range
        for period, frequency in zip(self.periods, (u, v), strict=True):
            if period is None:
                continue
            path = 1e3 * period * np.abs(frequency)  # nm, of order 1
            for n in range(1, math.floor(path.max(initial=0.0) / low) + 1):
                wavelength = path / n
                reached = (low <= wavelength) & (wavelength <= high)
                wavelength = np.where(reached, wavelength, high)
                yield wavelength, np.where(reached, self._width(wavelength, frequency), 0.0)

    def _takes(self, wi: Array, wo: Array, wavelength: Array) -> NDArray[np.bool_]:
        """Whether a λₙ is within half a step, or the pair is close to the mirror direction."""
        u, v, _ = diffraction_coordinates(wi, wo)
        taken = np.hypot(u, v) < self.specular
        for period, frequency in zip(self.periods, (u, v), strict=True):
            if period is not None:
                path = 1e3 * period * np.abs(frequency)
                nearest = np.maximum(np.round(path / wavelength), 1.0)
                taken |= np.abs(path / nearest - wavelength) <= 0.5 * self._step
        return taken

    def _width(self, wavelength: Array, frequency: Array) -> Array:
        """Δλ in nm."""
        if self.weighting == "step":
            return np.full(len(wavelength), self._step)
        slope = np.maximum(np.abs(frequency), 1e-12)
        return 1e-3 * wavelength**2 / (2.0 * math.sqrt(math.pi) * self.sigma * slope)
