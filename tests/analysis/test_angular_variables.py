"""Five variables of iridescence, of surfaces that have them exactly."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.analysis.angular_variables import DETECTORS, LAMPS, fitted

INCIDENT = np.repeat(LAMPS, len(DETECTORS))
COLLECTED = np.tile(-DETECTORS, len(LAMPS))


@pytest.mark.parametrize("tilt", [-8.0, 0.0, 3.0])
def test_a_layered_feather_s_variables_are_found(tilt):
    """Gruson and others 2019: a bell around the tilt, and Bragg's cosine."""
    x, y = 0.5 * (INCIDENT + COLLECTED), np.radians(0.5 * (INCIDENT - COLLECTED))
    brightness = 40.0 * np.exp(-0.5 * ((x - tilt) / 12.0) ** 2)
    row = fitted(INCIDENT, COLLECTED, brightness, 550.0 * np.cos(0.7 * y))
    expected = {"Bmax": 40.0, "t": tilt, "gammaB": 12.0, "Hmax": 550.0, "gammaH": 0.7}
    assert {name: row[name] for name in expected} == pytest.approx(expected, rel=1e-4, abs=1e-4)
    assert row["rmsB"] < 1e-3
    assert row["rmsH"] < 1e-3


def test_a_grating_s_colours_are_not_a_feather_s():
    """Its hue follows sinΘinc + sinΘcol: the fit says how far it is."""
    path = np.abs(np.sin(np.radians(INCIDENT)) + np.sin(np.radians(COLLECTED)))
    row = fitted(INCIDENT, COLLECTED, np.ones(len(path)), np.clip(1600.0 * path, 300.0, 700.0))
    assert row["rmsH"] > 50.0


def test_darkness_has_no_variables():
    assert fitted(INCIDENT, COLLECTED, 0.0 * INCIDENT, 0.0 * INCIDENT) == {}
