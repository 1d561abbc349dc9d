"""The cropped transform: equal to the plain sum, precise where light fades, right for gratings."""

from __future__ import annotations

import numpy as np
import pytest

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
