"""The cropped transform: equal to the plain sum, precise where light fades, right for gratings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jv

from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.tables.build.spectrum import Spectrum
from tests.support.directions import rough_patch

PATCH = rough_patch((70, 81), (0.08, 0.07), 0.3)  # one even and one odd number of pixels
SINGLE = 1e-6  # float32: phases of a few radians times 6e-8, and a transform of 2¹² points


def plain_sum(kappa, jx, jy):
    """a_j of the centred heights, one order at a time."""
    ny, nx = PATCH.shape
    heights = PATCH.heights - 0.5 * (PATCH.heights.max() + PATCH.heights.min())
    x, y = np.arange(nx) / nx, np.arange(ny)[:, None] / ny
    return np.mean(np.exp(1j * kappa * heights) * np.exp(2j * np.pi * (jx * x + jy * y)))


@pytest.mark.parametrize(("double", "tolerance"), [(False, SINGLE), (True, 1e-13)])
def test_orders_are_those_of_the_plain_sum(double, tolerance):
    spectrum = Spectrum(PATCH, (6, 3), double=double)
    orders = spectrum.of_phase(20.0)
    assert orders.shape == spectrum.shape == (7, 13)
    for jx in (-6, -1, 0, 5):
        for jy in (-3, 0, 2):
            assert abs(orders[jy + 3, jx + 6] - plain_sum(20.0, jx, jy)) < tolerance


def test_beyond_nyquist_there_is_nothing():
    orders = Spectrum(PATCH, (50, 60)).of_phase(20.0)
    ny, nx = PATCH.shape
    x, y = np.meshgrid(np.arange(-50, 51), np.arange(-60, 61))
    known = (x >= -(nx // 2)) & (x <= (nx - 1) // 2) & (y >= -(ny // 2)) & (y <= (ny - 1) // 2)
    assert np.all(orders[~known] == 0)
    assert np.sum(np.abs(orders[known]) ** 2) == pytest.approx(1.0, abs=SINGLE)  # Parseval


def test_less_one_is_the_same_without_the_mirror():
    spectrum = Spectrum(PATCH, (5, 5), double=True)
    less = spectrum.of_phase(20.0, minus_one=True)
    less[5, 5] += 1.0
    assert np.abs(less - spectrum.of_phase(20.0)).max() < 1e-14  # rounding


def test_less_one_keeps_its_digits_where_the_surface_is_almost_flat():
    kappa = 1e-5  # phases of 1e-6: of exp(iκh) itself, single precision would keep nothing
    orders = Spectrum(PATCH, (5, 5)).of_phase(kappa, minus_one=True)
    exact = Spectrum(PATCH, (5, 5), double=True).of_phase(kappa, minus_one=True)
    scale = np.abs(exact).max()
    assert np.abs(orders - exact).max() < SINGLE * scale


@pytest.mark.parametrize("kappa", [0.7, 9.0, 33.0])
def test_a_sinusoid_s_orders_are_bessel_functions(kappa):
    field = gratings.sinusoidal(2.0, 0.3, periods=5, rows=20)
    power = np.abs(Spectrum(field, (40, 3)).of_phase(kappa)) ** 2
    for m in range(-8, 9):
        expected = jv(m, kappa * 0.15) ** 2
        assert power[3, 40 + 5 * m] == pytest.approx(expected, abs=SINGLE)
    power[3, ::5] = 0.0
    assert power.max() < SINGLE**2  # between the orders, and across, there is nothing


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("kappa", [0.7, 9.0, 33.0])
def test_a_sampled_lamellar_grating_s_orders(kappa, axis):
    n, depth = 50, 0.2
    field = gratings.lamellar(2.0, depth, periods=3, pixels_per_period=n, rows=20, axis=axis)
    power = np.abs(Spectrum(field, (24, 24)).of_phase(kappa)) ** 2
    line = power[24] if axis == "x" else power[:, 24]
    half = kappa * depth / 2
    for m in range(-7, 8):
        if m == 0:
            expected = np.cos(half) ** 2
        else:
            expected = (m % 2) * 4 * np.sin(half) ** 2 / (n * np.sin(np.pi * m / n)) ** 2
        assert line[24 + 3 * m] == pytest.approx(expected, abs=SINGLE)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_blazed_grating_sends_its_light_where_its_facets_descend(axis):
    depth = 0.25
    field = gratings.blazed(2.0, depth, periods=3, pixels_per_period=64, rows=64, axis=axis)
    power = np.abs(Spectrum(field, (24, 24)).of_phase(2 * np.pi / depth)) ** 2
    line = power[24] if axis == "x" else power[:, 24]
    # order +1 alone, less the steps' (π/64)²/3 = 8e-4
    assert line[24 + 3] == pytest.approx(1.0, abs=1e-3)
    assert line[24 - 3] < 1e-6
