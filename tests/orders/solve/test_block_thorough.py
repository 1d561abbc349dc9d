"""Tables of blocks beside an independent solver, on both sides."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.integral import IntegralSolver
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import polygon, sinusoidal
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating

pytest.importorskip("gratinglab")
pytestmark = pytest.mark.thorough

RANGE, INDEX = (500.0, 560.0), 1.5
SETTINGS = Settings(RANGE, tolerance=0.1, resolution=5)


@pytest.mark.parametrize(
    "profile",
    [sinusoidal(0.4, 0.05), polygon([(0.0, 0.0), (0.1, 0.06), (0.3, 0.06), (0.2, 0.0)], 0.4)],
    ids=["sinusoid", "slanted"],
)
def test_a_table_is_an_independent_solution_of_the_same_profile(profile):
    table = solve_orders(profile, INDEX, settings=SETTINGS, block=True)
    # the block below, as a thin sheet's upper side, with channels of the light above
    side = Grating(profile, material_of(INDEX, RANGE), 1.0, RANGE, thin=True)
    missed, total = np.zeros(2), np.zeros(2)  # in light from above, and from within
    for kind, tau, rho in ((0, 0.3, 0.4), (0, 0.8, 0.45), (1, 0.2, 0.3)):
        station = side.station(1, kind, tau, rho, [0.3])
        amplitudes = IntegralSolver(profile, 50).amplitudes(station)[0]
        powers = 0.5 * (np.abs(amplitudes) ** 2).sum(axis=(1, 3))
        n, y, lam = station.channels, station.along[0], 1e3 * station.wavelengths[0]
        c = np.sqrt(1.0 - y * y)
        numbers = np.concatenate([np.arange(n), station.inside])
        x = c * station.sines_of(numbers)
        below = np.arange(len(numbers)) >= n
        for j, from_within in enumerate(below):
            found = np.where(
                below == from_within,
                table.efficiency(x[j], y, lam, numbers[j] - numbers, from_below=from_within),
                table.efficiency(
                    x[j], y, lam, numbers[j] - numbers, from_below=from_within, transmitted=True
                ),
            )
            orders = numbers != numbers[j]
            missed[int(from_within)] += np.abs(found - powers[j])[orders].sum()
            total[int(from_within)] += powers[j][orders].sum()
            # order 0, which has most of the light
            assert np.abs(found - powers[j])[~orders].max() < 0.01
    assert total.min() > 0.05
    assert (missed < SETTINGS.tolerance * total).all()
