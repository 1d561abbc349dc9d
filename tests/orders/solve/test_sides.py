"""Thin sheets and blocks: Fresnel, perturbation, energy, reciprocity, and tables."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.coat import face_transmittance
from mitsuba_diffraction.orders.solve.coupled import CoupledWaves
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import problem_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import lamellar
from mitsuba_diffraction.orders.solve.resolution import coarsest
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.sheet import sheet_efficiencies
from mitsuba_diffraction.orders.solve.stations import Grating
from mitsuba_diffraction.reference.fresnel import reflectance
from mitsuba_diffraction.reference.through import flat_transmittances
from tests.orders.kinds import light

pytest.importorskip("gratinglab")

RANGE, INDEX = (400.0, 700.0), 1.58


def station(profile, tau=0.3, w=0.2):
    """Three channels outside, five within, in a conical mount."""
    surface = Grating(profile, material_of(INDEX, RANGE), 1.0, RANGE, thin=True)
    return surface.station(2, 0, tau, 0.6, [w])


def solved(profile, tau=0.3):
    place = station(profile, tau)
    return sheet_efficiencies(CoupledWaves(profile, 8).amplitudes(place), place)[0]


def sums(table, x, y, lam, from_below):
    """Reflected and transmitted light of all orders."""
    sides = ({"from_below": from_below, "transmitted": passed} for passed in (False, True))
    m = np.arange(-4, 5)[:, None]
    return np.array([table.efficiency(x, y, lam, m, **side).sum(axis=0) for side in sides])


def test_a_flat_sheet_is_fresnel_s():
    place, powers = station(lamellar(0.8, 1e-7)), solved(lamellar(0.8, 1e-7))
    c = np.sqrt(1.0 - place.along[0] ** 2)
    cosines = c * np.sqrt(1.0 - place.sines**2)
    through = flat_transmittances(cosines, INDEX, True).mean(axis=0)
    back = 1.0 - through
    assert np.all(back > reflectance(cosines, INDEX))
    found = 0.5 * powers.sum(axis=(1, 3))
    expected = np.block([[np.diag(back), np.diag(through)], [np.diag(through), np.diag(back)]])
    assert np.allclose(found, expected, atol=1e-6)


def test_a_sheet_is_solved_into_a_table():
    settings = Settings((560.0, 640.0), tolerance=0.2, method="coupled", resolution=4)
    table = solve_orders(lamellar(0.5, 0.05), INDEX, thin=True, settings=settings)
    assert table.thin
    assert table.header["energy_error"] < 1e-5
    assert table.reciprocity < 1e-4
    for from_below in (False, True):
        found = sums(table, np.array([0.2, -0.5]), 0.3, 600.0, from_below)
        # interpolation, beside the tolerance of 20 % of the orders
        assert found.sum(axis=0) == pytest.approx(1.0, abs=0.01)


def test_the_first_resolution_has_the_orders_within_the_material():
    """73 of them, and 19 outside."""
    profile = lamellar(5.0, 0.1)
    surface = Grating(profile, material_of(4.0, (550.0, 550.0)), 1.0, (550.0, 550.0), thin=True)
    place = surface.station(17, 0, 0.3, 0.5, [0.5])
    waves = CoupledWaves(profile, coarsest(problem_of(surface, "coupled", 0)))
    assert np.allclose((np.abs(waves.amplitudes(place)) ** 2).sum(axis=(3, 4)), 1.0, atol=1e-6)


#: Wavelengths, index and settings of blocks.
GREEN, BLOCK = (500.0, 560.0), 1.5
SETTINGS = Settings(GREEN, tolerance=0.1, resolution=4)


def test_a_flat_face_is_fresnel_s_from_both_sides_with_total_reflection():
    table = solve_orders(lamellar(0.4, 1e-7), BLOCK, settings=SETTINGS, block=True)
    for from_below, radius in ((False, 0.995), (True, BLOCK - 0.005)):
        x, y, lam = light(300, radius, GREEN)
        above = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
        expected = face_transmittance(above, BLOCK)
        assert (expected == 0.0).any() == from_below
        reflected, transmitted = sums(table, x, y, lam, from_below)
        # single precision; exact at the critical angle too
        assert np.abs(transmitted - expected).max() < 1e-5
        assert np.abs(reflected + transmitted - 1.0).max() < 1e-6
        alone = table.efficiency(x, y, lam, 0, from_below=from_below, transmitted=True)
        assert np.abs(alone - expected).max() < 1e-5


def test_a_block_keeps_all_light_and_sends_it_back_as_it_came():
    table = solve_orders(lamellar(0.4, 0.05, 0.3), BLOCK, settings=SETTINGS, block=True)
    assert table.sides == 2
    # single precision
    assert table.reciprocity < 1e-5
    for from_below, radius in ((False, 0.99), (True, 1.48)):
        reflected, transmitted = sums(table, *light(200, radius, GREEN), from_below)
        assert np.abs(reflected + transmitted - 1.0).max() < 1e-6
        # some light beyond the critical angle leaves by the grating
        assert transmitted.min() < 0.7 * transmitted.max()
    x, y, lam = 1.2, 0.1, 530.0
    step = lam / 400.0
    there = table.efficiency(x, y, lam, -1, from_below=True, transmitted=True)
    back = table.efficiency(step - x, -y, lam, -1, transmitted=True)
    assert there == pytest.approx(back, rel=1e-3)
    assert there > 0.005
