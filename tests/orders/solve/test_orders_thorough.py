"""The shipped tables, an echelle, and one direction of light on a long period."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders import OrderTable
from mitsuba_diffraction.orders.solve.grating_index import material_of
from mitsuba_diffraction.orders.solve.jobs import problem_of
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import polygon, sinusoidal
from mitsuba_diffraction.orders.solve.recipes import SolvedRecipe
from mitsuba_diffraction.orders.solve.resolution import STEP, coarsest
from mitsuba_diffraction.orders.solve.settings import Settings
from mitsuba_diffraction.orders.solve.stations import Grating
from tests.support import ROOT

pytestmark = pytest.mark.thorough


def test_the_shipped_tables_are_those_of_their_recipes():
    files = sorted((ROOT / "precompute" / "orders").glob("*.nc"))
    assert sum(file.stat().st_size for file in files) < 10e6
    for file in files:
        table, recipe = OrderTable.load(file), SolvedRecipe.load(file.with_suffix(".toml"))
        assert table.period == recipe.profile.period
        assert table.header["profile"] == recipe.profile.name
        assert table.wavelengths == recipe.settings.wavelengths
        assert table.superstrate == recipe.superstrate
        assert table.header["error_mean"] <= recipe.settings.tolerance
        assert table.header["reciprocity_error"] < 0.01


def test_the_first_resolution_of_an_echelle_carries_the_waves_along_its_facets():
    """R4, 63 lines/mm: no light from nothing, and Littrow's order is the brightest."""
    period, tangent, lam = 15.873, 4.0, (550.0, 550.0)
    width = period / (1.0 + tangent**2)
    echelle = polygon([(0, 0), (width, width * tangent)], period)
    grating = Grating(echelle, material_of("Al", lam), 1.0, lam)
    first = coarsest(problem_of(grating, "auto", 0))
    settings = Settings(wavelengths=lam, resolution=int(np.ceil(first * STEP)))
    sine = float(np.sin(np.arctan(tangent)))
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(
            echelle, "Al", theta=-np.degrees(np.arctan(tangent)), settings=settings
        )
    # with fewer harmonics than waves along a facet, efficiencies sum to 1e11 and more; the first
    # resolution, which has as many, misses 27 % of this light, and the second one is exact
    assert table.header["solver_error"] < 1e-3
    orders = table.response.orders[:, 0]
    shares = table.efficiency(sine, 0.0, lam[0], orders)
    assert shares.sum() < 1.0
    assert abs(orders[shares.argmax()] + 2.0 * sine * period / 0.55) <= 1.0


def test_one_direction_of_a_long_period_is_a_small_table():
    """Aluminium, 0.1 µm deep: its reflectance in all orders, a megabyte at most for 61 waves."""
    settings = Settings(wavelengths=(550.0, 550.0), tolerance=0.02)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(sinusoidal(50.0, 0.1), "Al", theta=20.0, settings=settings)
    assert 61 * table.nbytes < 1e6
    shares = table.efficiency(-np.sin(np.radians(20.0)), 0.0, 550.0, table.response.orders[:, 0])
    assert shares.sum() == pytest.approx(0.915, abs=0.01)
