"""The rainbow of simple shaders: colours from the spacing of a grating alone."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError
from ...optics.colour import response
from ...optics.geometry import diffraction_coordinates, sigma_of, wavenumber
from .gain import Gain
from .method import Array, Method
from .nmm import SPECULAR_WAVELENGTH
from .period import Period


class Rainbow(Method):
    """`rainbow`: every order of the grating equation d·|u| = nλ is equally strong.

    What many shaders do (after Guardado, GPU Gems 2004, chapter 8): heights do not enter, nor does
    the direction along the grooves, nor any decay towards grazing angles. The light of a Lambertian
    reflector, 1/π, is redistributed over the spectrum by a comb of lines of mean 1,

        f(λ) = 1/π · (2√π σ/d) Σ_n exp(−σ²(k|u| − 2πn/d)²),

    whose integral over wavelength, line by line, is

        XYZ = 1/π · [Σ_{n≥1} s̄(λₙ)·λₙ²/(d|u|) + (2√π σ/d)·exp(−σ²k₅₅₅²u²)·white],  λₙ = d|u|/n.

    The last summand is order 0, the white streak across the mirror direction.

    Parameters
    ----------
    period : along x or y.
    coherence_width : µm, 4σ: width of the lines.
    wavelength_range : nm.
    """

    def __init__(
        self,
        period: Period,
        *,
        coherence_width: float = 65.0,
        wavelength_range: tuple[float, float] = (380.0, 780.0),
        name: str = "rainbow",
    ) -> None:
        self.name, self.period = name, period
        self.sigma = sigma_of(coherence_width)
        self.wavelength_range = wavelength_range
        self._density = 2.0 * math.sqrt(math.pi) * self.sigma / period.length

    def window_sum(self, wi: Array, wo: Array, wavelength: Array) -> Array:
        """The comb, (2√π σ/d) Σ_n exp(−σ²(k|u| − 2πn/d)²): mean 1 over frequency."""
        line = self._frequency(wi, wo) * wavenumber(wavelength) * self.period.length / (2 * np.pi)
        sharpness = (2.0 * np.pi * self.sigma / self.period.length) ** 2
        # the nearest line on either side: others matter only where the window holds no period
        reach = max(1, math.ceil(3.0 / math.sqrt(sharpness)))
        offsets = np.round(line)[:, None] + np.arange(-reach, reach + 1)
        lines = np.exp(-sharpness * (line[:, None] - offsets) ** 2)
        return self._density * lines.sum(axis=1)

    def samples(self, wi: Array, wo: Array) -> Iterator[tuple[Array, Array]]:
        """λₙ and the gaps between them, λₙ²/(d|u|)."""
        low, high = self.wavelength_range
        path = 1e3 * self.period.length * self._frequency(wi, wo)  # nm, of order 1
        for n in range(1, math.floor(path.max(initial=0.0) / low) + 1):
            wavelength = path / n
            reached = (low <= wavelength) & (wavelength <= high)
            gap = np.where(reached, wavelength / n, 0.0)
            yield np.where(reached, wavelength, high), gap

    def relative(
        self, wi: ArrayLike, wo: ArrayLike, wavelength: ArrayLike, gain: Gain | None = None
    ) -> Array:
        """Refused: there is no mirror that it would be relative to."""
        raise self._refused()

    def _xyz(self, wi: Array, wo: Array, gain: Gain | None) -> Array:
        if gain is not None:
            raise self._refused()
        total = np.zeros((len(wi), 3))
        for wavelength, gap in self.samples(wi, wo):
            total += gap[:, None] * response(wavelength)
        spread = self.sigma * float(wavenumber(SPECULAR_WAVELENGTH)) * self._frequency(wi, wo)
        total += (self._density * np.exp(-(spread**2)))[:, None] * self._white()
        return total / np.pi

    def _scaled(self, wi: Array, wo: Array, wavelength: Array, gain: Gain | None) -> Array:
        return self.window_sum(wi, wo, wavelength) / np.pi

    def _frequency(self, wi: Array, wo: Array) -> NDArray[np.float64]:
        u, v, _ = diffraction_coordinates(wi, wo)
        return np.abs(u if self.period.axis == "x" else v)

    def _refused(self) -> DiffractionError:
        return DiffractionError(
            "method 'rainbow' has no relative reflectance: it knows no mirror to compare with; "
            "leave it out, or ask for the BRDF"
        )
