"""The package's orders against closed forms, and the forms against each other."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation.cases import PROFILES, Grating
from docs.make.validation.closed_forms import deviations, order_power
from mitsuba_diffraction.heights import gratings


@pytest.mark.parametrize(("period", "depth"), [(1.1, 0.4), (2.5, 0.1)])
@pytest.mark.parametrize("profile", PROFILES)
def test_orders_hold_within_1e_4_up_to_75_degrees(profile, period, depth):
    found = deviations(Grating(profile, period, depth), pixels=256)
    assert found.orders > 100
    # the goal; the sampling of lamellar gratings leaves 4/(3·256²) = 2e-5 of it, and the table's
    # tolerance 3e-5
    assert found.integral < 3e-5
    assert found.table < 6e-5


@pytest.mark.parametrize("profile", PROFILES)
def test_the_orders_of_the_closed_forms_carry_all_light(profile):
    orders = np.arange(-3000, 3001)
    for kappa in (0.5, 9.0, 28.0):
        total = order_power(Grating(profile, 2.0, 0.3), orders, kappa).sum()
        # what lies beyond order n falls as 1/n where there are edges: 2·4/(π²·3000)/2
        assert total == pytest.approx(1.0, abs=2e-4)


def test_a_wrong_grating_is_noticed():
    # one that descends instead: the check can fail
    field = gratings.blazed(2.5, 0.1, periods=1, pixels_per_period=256, rows=2)
    screen = np.exp(1j * 15.0 * field.heights[0])
    power = np.abs(np.fft.ifft(screen)) ** 2
    orders = np.arange(-3, 4)
    exact = order_power(Grating("blazed", 2.5, 0.1), orders, 15.0)
    assert np.abs(power[orders] - exact).max() > 0.01
    assert power[-orders] == pytest.approx(exact, abs=1e-4)
