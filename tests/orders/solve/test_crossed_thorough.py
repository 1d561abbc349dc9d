"""Tables of crossed gratings, solved on several processes."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.orders.solve import crossed
from mitsuba_diffraction.orders.solve.jobs import Jobs, processes
from mitsuba_diffraction.orders.solve.settings import Settings

pytestmark = pytest.mark.thorough

PIXELS = 24
Y, X = np.mgrid[:PIXELS, :PIXELS] / PIXELS


def test_a_table_of_bumps_says_its_errors():
    heights = 0.021 * (np.cos(2 * np.pi * X) + np.cos(2 * np.pi * Y))
    settings = Settings((500.0, 540.0), tolerance=0.1, resolution=3)
    with processes(2) as executor:
        table = md.solve_orders(
            HeightField(heights, 0.55 / PIXELS), 1.5, settings=settings, jobs=Jobs(None, executor)
        )
    assert table.response.orders.max() == 2
    # beside Rayleigh anomalies, which directions 10° and 15° apart do not resolve
    assert 0.0 < table.header["error_mean"] < 0.05
    assert table.header["solver_error"] < 0.01
    normal = table.efficiency(0.0, 0.0, 520.0, [1, 0, -1, 0], [0, 1, 0, -1])
    assert normal == pytest.approx(normal[0], rel=1e-3)
    # light of each polarisation
    assert table.polarised_efficiency(0.3, 0.2, 520.0, 0, 0).shape == (2,)


def test_mirror_planes_give_the_light_of_mirrored_directions(monkeypatch):
    blazed_along_y = HeightField(
        0.05 * np.cos(2 * np.pi * X) + 0.06 * (Y < 1 / 3) + 0.03 * (Y < 2 / 3), 0.6 / PIXELS
    )
    assert crossed._mirrors(blazed_along_y.heights) == (True, False)
    settings = Settings((550.0, 550.0), resolution=3, polarised=True)
    light = {"theta": [0.0, 40.0], "phi": [50.0, 130.0, 290.0], "settings": settings}
    mirrored = md.solve_orders(blazed_along_y, 1.5, **light)
    monkeypatch.setattr(crossed, "_mirrors", lambda heights: (False, False))
    direct = md.solve_orders(blazed_along_y, 1.5, **light)
    # single precision
    assert mirrored.response.values == pytest.approx(direct.response.values, abs=1e-7)
