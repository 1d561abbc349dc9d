"""Crops of a surface, whose order 0 has the light's window, against the whole."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.heights.read import LoadOptions, treated_by_default
from tests.support.mirror import FAST, beside_the_mirror

# small and coarse scans are what is tested
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]


def rough_ridges(n, pixel):
    """Ridges 1.25 µm apart that waver, and roughness of all lengths: (n, n) heights in µm."""
    rng = np.random.default_rng(1)
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(n, pixel), np.fft.fftfreq(n, pixel)))

    def noise(amplitude):
        field = np.fft.ifft2(np.fft.fft2(rng.standard_normal((n, n))) * amplitude).real
        return field / field.std()

    roughness = noise(np.exp(-((f / 2.5) ** 2)) / (f + 0.1))
    wavering = noise(np.exp(-((5.0 * f) ** 2)))
    x = np.arange(n) * pixel
    return 0.015 * roughness + 0.03 * np.sin(2 * np.pi * x / 1.25 + 0.7 * wavering)


def test_crops_of_a_rough_surface_have_the_light_of_the_whole():
    """Six crops of 10 µm, as files of them are treated by default, against the whole 266 µm."""
    pixel, n, side = 0.25, 1064, 40
    heights, rng = rough_ridges(n, pixel), np.random.default_rng(5)
    limit = {"tolerance": 1e-2, "frequency_limit": (6.0, 1.5), **FAST}
    whole = md.DiffractionTable.build(md.HeightField(heights, pixel, periodic=True), **limit)
    crops = []
    for _ in range(6):
        y, x = rng.integers(0, n - side, 2)
        part = md.HeightField(heights[y : y + side, x : x + side], pixel, cut_out=True)
        treated = treated_by_default(part, LoadOptions())
        crops.append(md.DiffractionTable.build(treated, **limit))
    wavelengths = np.arange(450.0, 801.0, 50.0)
    for degrees in (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0):
        truth = beside_the_mirror(whole, degrees, wavelengths)
        found = np.mean([beside_the_mirror(crop, degrees, wavelengths) for crop in crops], axis=0)
        # the window of a crop blurs frequencies nearer to 0 than twice that of the longest wave
        # in it: there some light is missing, and no more is added
        assert np.all(found < 2.0 * truth), (degrees, found / truth)
        seen = np.sin(np.radians(degrees)) / wavelengths > 2e-3 / (side * pixel)
        assert np.all(found[seen] > 0.5 * truth[seen]), (degrees, found / truth)
