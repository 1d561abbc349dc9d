"""The rainbow: colours from the spacing of a grating alone."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, HeightField
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import Gain
from tests.directions import polar


def test_the_rainbow_s_colour_is_the_integral_of_its_spectrum(grating):
    method = methods.make("rainbow", grating, coherence_width=60.0)
    wo = np.array([polar(t) for t in (20.0, 35.0, 50.0, 70.0)])
    wavelength = np.arange(380.0, 780.01, 0.05)
    expected = np.zeros((4, 3))
    for n, direction in enumerate(wo):
        f = method.brdf(polar(0.0), np.broadcast_to(direction, (wavelength.size, 3)), wavelength)
        expected[n] = (f[:, None] * response(wavelength)).sum(axis=0) * 0.05
    # the observer's curves bend within a line of some nm
    assert np.abs(method.xyz(polar(0.0), wo) - expected).sum() < 0.01 * expected.sum()


def test_many_orders_together_are_white():
    flat = HeightField(np.zeros((4, 4)), 0.1)
    method = methods.make("rainbow", flat, period=60.0, coherence_width=65.0)
    xyz = method.xyz(polar(0.0), polar(60.0))[0]
    # a Lambertian white: 1/π in every channel of D65; some 70 orders are a fine sum already
    np.testing.assert_allclose(xyz * np.pi, [0.9505, 1.0, 1.089], rtol=5e-3)


def test_the_rainbow_has_no_relative_reflectance(grating):
    method = methods.make("rainbow", grating)
    with pytest.raises(DiffractionError, match="no relative reflectance"):
        method.relative(polar(0.0), polar(0.0), 500.0)
    with pytest.raises(DiffractionError, match="no relative reflectance"):
        method.xyz(polar(0.0), polar(0.0), gain=Gain())
