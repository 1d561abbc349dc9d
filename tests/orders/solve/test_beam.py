"""Orders of some directions of light alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders.listing import list_orders
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import lamellar, sinusoidal
from mitsuba_diffraction.orders.solve.settings import Settings

#: One wavelength.
GREEN = Settings(wavelengths=(550.0, 550.0))


def test_efficiencies_of_one_direction_are_those_solved():
    """Also of a few wavelengths, which are narrower than the distance of usual nodes."""
    profile, settings = lamellar(0.376, 0.36, 0.6), Settings((522.0, 542.0))
    mirror = [("1.46", 0.104), ("1.95", 0.073)] * 8
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table, between = (
            solve_orders(
                profile, 1.46, theta=45.0, step=4.0, beneath=mirror,
                settings=replace(settings, wavelengths=ends, resolution=8),
            )
            for ends in ((522.0, 542.0), (524.0, 540.0))
        )  # fmt: skip
    # half way between wavelengths, by the other table's own nodes
    x = -np.sin(np.radians(45.0))
    for wavelength in np.linspace(524.0, 540.0, 5):
        expected, got = (
            np.stack([each.polarised_efficiency(x, 0.0, wavelength, m) for m in (0, 1)])
            for each in (between, table)
        )
        # single precision, and the smooth curve through steps of 4 nm
        np.testing.assert_allclose(got, expected, atol=1e-3)


def test_the_integral_method_solves_an_order_that_leaves_at_grazing():
    """0.17° from grazing, where 60 points make 2 % of light and 4 % go wrong."""
    pytest.importorskip("gratinglab")
    sine = np.sqrt(1.0 - 0.003**2) - 0.55
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table, other = (
            solve_orders(
                sinusoidal(1.0, 0.2), "Al", theta=-np.degrees(np.arcsin(sine)),
                settings=replace(GREEN, method=method),
            )
            for method in ("integral", "chandezon")
        )  # fmt: skip
    light = sine, 0.0, 550.0, np.arange(-3, 2)
    missed = np.abs(table.efficiency(*light) - other.efficiency(*light)).sum()
    # the next resolution changes at most half the tolerance in either
    assert missed < GREEN.tolerance


def test_both_sides_are_alike_where_orders_graze_on_both():
    """K = 2d/λ is 4: orders 2 and -2 graze at once, and neither is solved without the other."""
    settings = Settings(wavelengths=(500.0, 500.0), resolution=12)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(sinusoidal(1.0, 0.1), 1.5, theta=0.0, settings=settings)
    assert (table.response.orders[:, 0] == np.arange(-2, 3)).all()
    left, right = table.efficiency(0.0, 0.0, 500.0, [-1, 1])
    assert left == pytest.approx(right, rel=1e-6)  # single precision
    listing = list_orders(table, 500.0, 0.0)
    assert listing.rows[:, 3].tolist() == [-1, 0, 1]
