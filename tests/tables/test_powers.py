"""Powers of tables that store amplitudes, as series in κ."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.tables.powers import as_powers, order_0_power, powers_at
from tests.support.directions import rough_patch


def test_a_series_of_powers_is_that_of_the_amplitudes_squared():
    deep = rough_patch((16, 16), (0.15, 0.15), 0.4)
    given = {"coherence_width": 2.4, "basis": "taylor", "tolerance": 0.02}
    table = DiffractionTable.build(deep, **given)
    powers = as_powers(table)
    assert powers.expansion.kind == "power" != table.expansion.kind
    for kappa in table.expansion.kappa_max * np.linspace(0.05, 0.95, 7):
        exact, found = (powers_at(one, float(kappa)) for one in (table, powers))
        # 12 terms for 4 rad of an amplitude's phase: below the usual tolerance of a table
        assert np.abs(found - exact).sum() < 1e-3
        assert abs(order_0_power(powers, kappa) - order_0_power(table, kappa)) < 1e-4
