"""Groove profiles from the angles that an engineer knows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.orders.solve.profiles import Profile

# samples of a rounded profile
_SAMPLES = 1600


class Groove(NamedTuple):
    """Ruled groove: a long facet, a short one, and their flaws.

    facet : angle of the long facet to the grating's plane, degrees.
    apex : angle between the facets, degrees; a ruling diamond has about 90.
    roughness : RMS height of roughness finer than the period, nm.
    rounding : width over which heights are averaged, nm.
    """

    facet: float
    apex: float = 90.0
    roughness: float = 0.0
    rounding: float = 0.0

    def profile(self, period: float) -> Profile:
        """Return one period in µm; the short facet faces light of x > 0."""
        rise = np.tan(np.radians(self.facet))
        steep = np.radians(180.0 - self.apex - self.facet)
        width = period / (1.0 + rise / np.tan(steep))
        x, z = np.array([0.0, width]), np.array([0.0, rise * width])
        sharp = Profile(x, z, period, f"ruled, {self.facet:.2f}° and {self.apex:.0f}°")
        if not self.rounding:
            return sharp
        places = np.arange(_SAMPLES) / _SAMPLES * period
        heights = np.interp(places, *sharp.closed)
        frequency = np.fft.rfftfreq(_SAMPLES, period / _SAMPLES)
        kernel = np.sinc(1e-3 * self.rounding * frequency)
        rounded = np.fft.irfft(np.fft.rfft(heights) * kernel, _SAMPLES)
        return Profile(places, rounded, period, f"{sharp.name}, rounded")

    def specular(self, wavelength: float, path: float) -> float:
        """Return the power that fine roughness leaves in the orders.

        exp(−(2π path σ/λ)²) (Beckmann and Spizzichino 1963); path : of light per height, 2 of a
        mirror in light along its normal.
        """
        return float(np.exp(-((2.0 * np.pi * path * self.roughness / wavelength) ** 2)))
