"""Mirror planes of crossed gratings."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.orders.solve import crossed
from mitsuba_diffraction.orders.solve.settings import Settings

pytestmark = pytest.mark.thorough

PIXELS = 24
Y, X = np.mgrid[:PIXELS, :PIXELS] / PIXELS


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
