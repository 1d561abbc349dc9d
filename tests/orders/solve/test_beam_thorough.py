"""An echelle in its mount."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.orders.solve.orders import solve_orders
from mitsuba_diffraction.orders.solve.profiles import polygon
from mitsuba_diffraction.orders.solve.settings import Settings

pytestmark = pytest.mark.thorough


def test_an_echelle_sends_its_light_back_into_the_order_of_its_blaze():
    """R2, 79 lines/mm, aluminium: 2 d sin θ = m λ has m = 41 at 552 nm."""
    period, tangent = 1e3 / 79, 2.0
    width = period / (1.0 + tangent**2)
    echelle = polygon([(0, 0), (width, width * tangent)], period)
    theta = np.degrees(np.arctan(tangent))
    lam = 2e3 * period * np.sin(np.radians(theta)) / 41
    settings = Settings(wavelengths=(lam, lam), resolution=80)
    with pytest.warns(md.DiffractionWarning, match="nearest direction"):
        table = solve_orders(echelle, "Al", theta=-theta, settings=settings)
    efficiency = table.polarised_efficiency(np.sin(np.radians(theta)), 0.0, lam, -41)
    # the facet is 41 half waves deep: most of R = 0.91 but for shadowed edges
    assert efficiency[0] > 0.6
    # its next resolution
    assert table.header["solver_error"] < 1e-3
