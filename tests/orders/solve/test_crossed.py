"""Solutions of crossed gratings, beside solvers of grooves, closed forms, and ikarus-rcwa."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.orders.solve.crossed import CrossedWaves
from mitsuba_diffraction.orders.solve.profiles import UnitCell
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import CrossedStation
from mitsuba_diffraction.reference.fresnel import amplitudes
from tests.orders.kinds import light

PERIOD, LAM, LIMITS, PIXELS = 0.6, 550.0, (500.0, 700.0), 24
Y, X = np.mgrid[:PIXELS, :PIXELS] / PIXELS
#: Without mirror planes, so that every sign shows.
LUMPS = 0.03 * (np.cos(2 * np.pi * X) + np.sin(2 * np.pi * (X + Y)) + np.sin(4 * np.pi * Y))


def reflected(heights, periods, theta, phi, harmonics):
    """Unpolarised efficiencies by order, of light from (θ, φ)."""
    sine, turn = np.sin(np.radians(theta)), np.radians(phi)
    station = CrossedStation(
        -sine * np.cos(turn), -sine * np.sin(turn), 1e-3 * LAM, 1.5 + 0j, periods
    )
    orders = [tuple(order) for order in station.orders.tolist()]
    solved = CrossedWaves(UnitCell(heights, periods), harmonics).amplitudes(station)[0]
    powers = (np.abs(solved[orders.index((0, 0))]) ** 2).sum(axis=-1).mean(axis=0)
    return dict(zip(orders, powers.tolist(), strict=True))


def test_a_table_of_a_flat_cell_has_fresnel_s_light_of_s_and_p_in_all_directions():
    settings = Settings((500.0, 500.0), resolution=3, polarised=True)
    table = md.solve_orders(HeightField(np.zeros((4, 4)), 0.05), 1.5, settings=settings)
    x, y, _ = light(200, 1.0)
    shares = np.abs(np.stack(amplitudes(np.sqrt(1.0 - x**2 - y**2), 1.5), axis=-1)) ** 2
    # half floats; their ratio is linear between directions 8° apart
    assert table.efficiency(x, y, 500.0, 0) == pytest.approx(shares.mean(axis=-1), rel=1e-3)
    found = table.polarised_efficiency(x, y, 500.0, 0)
    assert np.abs(found - shares).max() < 0.01


def test_lumps_have_the_orders_of_ikarus():
    ikarus = pytest.importorskip("ikarus")
    theta, phi, count = 30.0, 25.0, 8
    found = reflected(LUMPS, (PERIOD, PERIOD), theta, phi, 4)
    shares = (LUMPS - LUMPS.min()) / np.ptp(LUMPS)
    solved = []
    for turn in (0.0, 90.0):
        solver = ikarus.RCWA(
            1e-6 * PERIOD, 1e-6 * PERIOD, resolution=(PIXELS, PIXELS), n_orders=(4, 4)
        )
        solver.add_uniform_layer(np.inf, 1.0)
        for level in 1.0 - (np.arange(count) + 0.5) / count:
            ridges = (shares > level).astype(int).T
            solver.add_layer(1e-6 * np.ptp(LUMPS) / count, ridges, [1.0, 1.5])
        solver.add_uniform_layer(np.inf, 1.5)
        # its azimuth is that in which the light travels, and its orders count the other way
        solver.set_source(
            wavelength=1e-9 * LAM, theta=theta, phi=phi + 180.0, polarization="linear",
            linear_pol_angle=turn,
        )  # fmt: skip
        solved.append(solver.simulate()[2])
    for (m, n), share in found.items():
        truth = np.mean([float(each.R_orders[each.order_index(-m, -n)]) for each in solved])
        # its 8 slices are within 3 % of 16
        assert share == pytest.approx(truth, rel=0.05, abs=1e-5)
