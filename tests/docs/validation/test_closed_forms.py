"""The package's orders against closed forms, and the forms against each other."""

from __future__ import annotations

import pytest

from docs.make.validation.cases import PROFILES, Grating
from docs.make.validation.closed_forms import deviations


@pytest.mark.parametrize(("period", "depth"), [(1.1, 0.4), (2.5, 0.1)])
@pytest.mark.parametrize("profile", PROFILES)
def test_orders_hold_within_1e_4_up_to_75_degrees(profile, period, depth):
    found = deviations(Grating(profile, period, depth), pixels=256)
    assert found.orders > 100
    # the goal; the sampling of lamellar gratings leaves 4/(3·256²) = 2e-5 of it, and the table's
    # tolerance 3e-5
    assert found.integral < 3e-5
    assert found.table < 6e-5
