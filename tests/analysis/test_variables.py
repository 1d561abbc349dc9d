"""Variables of spectra and of iridescence against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.analysis.angular_variables import (
    DETECTORS,
    LAMPS,
    fitted,
)
from mitsuba_diffraction.analysis.spectra import Spectra
from mitsuba_diffraction.analysis.spectra_files import spectra_figure
from mitsuba_diffraction.analysis.spectral_variables import colours_of
from mitsuba_diffraction.analysis.spectrometer import MeasurementGeometry

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


LAM = np.arange(300.0, 701.0, 1.0)


def test_variables_of_a_bell_are_its_closed_forms():
    curve = 0.1 + 0.4 * np.exp(-0.5 * ((LAM - 520.0) / 30.0) ** 2)
    (row,) = colours_of(Spectra(LAM, curve[:, None], MeasurementGeometry(30.0, (-10.0,)), "white"))
    assert row["spectrum"] == "light30_detectorm10"
    mean = 10.0 + 40.0 * 30.0 * np.sqrt(2.0 * np.pi) / 401.0  # the bell ends within the range
    assert (row["B2"], row["B3"], row["H1"]) == pytest.approx((mean, 50.0, 520.0), rel=1e-4)
    assert row["B1"] == pytest.approx(401.0 * row["B2"], rel=1e-4)
    assert row["S8"] == pytest.approx(40.0 / mean, rel=1e-3)
    assert row["FWHM"] == pytest.approx(2.3548 * 30.0, abs=2.0)  # whole nanometres
    assert 90.0 < row["hue"] < 170.0
    assert 0.2 < row["chroma"] <= 1.0


def test_white_has_no_chroma_and_black_no_colour():
    geometry = MeasurementGeometry(30.0, (0.0, 10.0))
    lam = np.arange(360.0, 831.0, 5.0)
    white, black = colours_of(Spectra(lam, np.tile([1.0, 0.0], (lam.size, 1)), geometry, "white"))
    assert white["chroma"] == pytest.approx(0.2, abs=0.2)  # equal energy is not quite D65
    assert "srgb" not in black
    assert black["S8"] == ""


@pytest.mark.parametrize("detectors", [1, 12])
def test_a_single_wavelength_is_drawn_as_points(detectors):
    geometry = MeasurementGeometry(30.0, tuple(5.0 * np.arange(detectors)))
    value = np.full((1, detectors), 0.3)
    spectra = Spectra(np.array([633.0]), value, geometry, "white")
    (axes,) = spectra_figure({"": spectra}).axes
    assert len(axes.lines) == detectors
    assert {line.get_marker() for line in axes.lines} == {"o"}
