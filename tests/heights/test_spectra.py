"""Spectra are normalised, and orders lie where gratings throw them."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.heights.gratings import blazed, sinusoidal
from mitsuba_diffraction.heights.spectra import (
    far_field,
    frequencies,
    height_spectrum,
    order_powers,
    profile,
)


def test_the_spectrum_integrates_to_the_variance():
    rng = np.random.default_rng(0)
    field = HeightField(rng.standard_normal((96, 160)), (0.1, 0.2))
    (fx, fy), density = frequencies(field), height_spectrum(field)
    total = density.sum() * (fx[1] - fx[0]) * (fy[1, 0] - fy[0, 0])
    # the window leaves 15360·(2/3)² independent values, whose variance scatters by 2 %
    assert total == pytest.approx(field.rms_height**2, rel=0.05)


def test_orders_share_the_light():
    field = sinusoidal(2.5, 0.3, periods=3)
    assert order_powers(field, 550.0).sum() == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("axis", "direction"), [("x", "descending"), ("y", "ascending")])
def test_a_blaze_throws_light_its_way(axis, direction):
    # at 500 nm a blaze of 0.25 µm is a wavelength deep there and back: all in one order
    field = blazed(2.5, 0.25, direction=direction, axis=axis, periods=8, pixels_per_period=64)
    powers = order_powers(field, 500.0)
    y, x = np.unravel_index(powers.argmax(), powers.shape)
    fx, fy = frequencies(field)
    expected = 0.4 if direction == "descending" else -0.4  # 1/period, towards the descent
    assert (fx[x], fy[y, 0])[axis == "y"] == pytest.approx(expected)
    light = far_field(field, 500.0, 201)
    v, u = np.unravel_index(np.nanargmax(light), light.shape)
    sines = np.linspace(-1, 1, 201)
    assert (sines[u], sines[v])[axis == "y"] == pytest.approx(expected * 0.5, abs=0.011)  # a pixel


def test_profiles_separate_directions():
    field = sinusoidal(1.0, 0.2, periods=20, rows=640)
    edges = np.array([0.5, 0.9, 1.1, 2.0])
    density = height_spectrum(field)
    along, across = (profile(density, field, edges, d) for d in ("x", "y"))
    assert along.argmax() == 1
    assert across.max() < 1e-6 * along.max()  # the window's side lobes


def test_rings_without_frequencies_are_nan():
    field = sinusoidal(1.0, 0.2, periods=2, rows=8)
    assert np.isnan(profile(height_spectrum(field), field, np.array([1e-4, 1e-3]))).all()


def test_nothing_is_seen_beyond_the_horizon():
    light = far_field(sinusoidal(1.0, 0.2, periods=4, rows=32), 550.0, 51)
    sines = np.linspace(-1, 1, 51)
    radius = np.hypot(sines[None, :], sines[:, None])
    assert np.isnan(light[radius > 1.001]).all()  # the horizon itself is a matter of rounding
    assert np.isfinite(light[radius < 0.999]).all()
