"""Blocks: Fresnel's face, energy, reciprocity, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.coat import face_transmittance
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import lamellar
from mitsuba_diffraction.orders.solve.settings import Settings

RANGE, INDEX = (500.0, 560.0), 1.5
WALLS = lamellar(0.4, 0.05, 0.3)
SETTINGS = Settings(RANGE, tolerance=0.1, resolution=4)


def sums(table, x, y, lam, from_below):
    """Reflected and transmitted light of all orders."""
    sides = [
        sum(
            table.efficiency(x, y, lam, m, from_below=from_below, transmitted=transmitted)
            for m in range(-4, 5)
        )
        for transmitted in (False, True)
    ]
    return np.array(sides)


def light(n, radius):
    """Tangential parts over 2π/λ within a radius, and wavelengths."""
    rng = np.random.default_rng(2)
    r, azimuth = radius * np.sqrt(rng.random(n)), 2.0 * np.pi * rng.random(n)
    return r * np.cos(azimuth), r * np.sin(azimuth), rng.uniform(*RANGE, n)


def test_a_flat_face_is_fresnel_s_from_both_sides_with_total_reflection():
    table = solve_orders(lamellar(0.4, 1e-7), INDEX, settings=SETTINGS, block=True)
    for from_below, radius in ((False, 0.995), (True, INDEX - 0.005)):
        x, y, lam = light(300, radius)
        above = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
        expected = face_transmittance(above, INDEX)
        assert (expected == 0.0).any() == from_below
        reflected, transmitted = sums(table, x, y, lam, from_below)
        # single precision; exact at the critical angle too
        assert np.abs(transmitted - expected).max() < 1e-5
        assert np.abs(reflected + transmitted - 1.0).max() < 1e-6
        alone = table.efficiency(x, y, lam, 0, from_below=from_below, transmitted=True)
        assert np.abs(alone - expected).max() < 1e-5


def test_a_block_keeps_all_light_and_sends_it_back_as_it_came():
    table = solve_orders(WALLS, INDEX, settings=SETTINGS, block=True)
    assert table.sides == 2
    # single precision
    assert table.reciprocity < 1e-5
    for from_below, radius in ((False, 0.99), (True, 1.48)):
        reflected, transmitted = sums(table, *light(200, radius), from_below)
        assert np.abs(reflected + transmitted - 1.0).max() < 1e-6
        # some light beyond the critical angle leaves by the grating
        assert transmitted.min() < 0.7 * transmitted.max()
    x, y, lam = 1.2, 0.1, 530.0
    step = lam / 400.0
    there = table.efficiency(x, y, lam, -1, from_below=True, transmitted=True)
    back = table.efficiency(step - x, -y, lam, -1, transmitted=True)
    assert there == pytest.approx(back, rel=1e-3)
    assert there > 0.005


@pytest.mark.parametrize(
    ("profile", "material", "settings", "message"),
    [
        (WALLS, "Al", SETTINGS, "clear"),
        (WALLS, "1.5+0.1i", SETTINGS, "clear"),
        (WALLS, "6", SETTINGS, "1.01 to 5"),
        (WALLS, "1.5", Settings(method="integral"), "coupled"),
        (WALLS, "1.5", Settings(polarised=True), "efficiencies alone"),
    ],
)
def test_gratings_that_are_not_solved_are_refused_in_one_line(profile, material, settings, message):
    with pytest.raises(DiffractionError, match=message) as caught:
        solve_orders(profile, material, settings=settings, block=True)
    assert "\n" not in str(caught.value)
