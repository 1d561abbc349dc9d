"""What the room of the thesis refuses, in one line that says what is wrong: a row each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import LightDirection
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import Gain
from mitsuba_diffraction.thesis.period_fit import Beam, fit_period, measure, ridge_of
from mitsuba_diffraction.thesis.sweeps import sweep
from tests.support.directions import polar, rough_patch
from tests.support.refusals import refused

GRATING = gratings.sinusoidal(2.0, 0.12, periods=8)
ROUGH = rough_patch((128, 128), (0.1, 0.1), 0.2, seed=7)
FLAT = HeightField(np.zeros((16, 16)), 0.5, name="flat")
UP = polar(0.0)


def made(name: str, patch: HeightField = GRATING, **arguments: Any) -> Any:
    return methods.make(name, patch, **({"coherence_width": 12.0} | arguments))


def swept(kind: str, **arguments: Any) -> object:
    given = {
        "coherence_width": 20.0,
        "resolution": 24,
        "samples": 4,
        "wavelength_range": (400, 700),
    }
    return sweep(kind, GRATING, LightDirection(20.0), **(given | arguments))


def ridge(patch: HeightField = GRATING, order: int = 1, **axes: Any) -> Any:
    method = made("spectral", patch)
    asked = {
        "wavelengths": np.arange(380.0, 781.0, 20.0),
        "angles": np.linspace(-30, 75, 106),
    } | axes
    return ridge_of(measure(method.brdf, Beam(), **asked, sigma=method.sigma, label="a"), order)


#: What is asked for, and words of the line.
REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: made("ray"), "method='ray' is unknown; choose one of spectral, flss"),
    (lambda: made("flss", step=0.0), "step=0 nm does not fit"),
    (lambda: made("flss", step=900.0), "step=900 nm does not fit"),
    (lambda: made("flss", wavelength_range=(700.0, 400.0)), "wavelength_range=700, 400 nm"),
    (lambda: made("flss", coherence="some"), "coherence='some' must be one of"),
    (lambda: made("flss", coherence_width=65.0, terms=3), "terms=3 of basis='taylor' leave"),
    (lambda: made("nmm", period=-1.0), "period=-1.0 must be"),
    (lambda: made("nmm", nmm_weights="some"), "weights='some' is unknown"),
    (lambda: made("nmm", specular=9.0), "specular=9 must be"),
    (lambda: made("pq", repeats=(0, 1)), r"repeats=\(0, 1\) must be"),
    (lambda: made("nmm", ROUGH), r"needs a period.*confidence 0\.\d.*give period"),
    (lambda: made("rainbow", ROUGH), r"needs a period.*confidence 0\.\d.*give period"),
    (lambda: made("flss").brdf(np.zeros((4, 2)), np.zeros((4, 2)), 500.0), r"must be \(n, 3\) or"),
    (lambda: made("flss").xyz(np.zeros((4, 3)), np.zeros((5, 3))), r"must be \(n, 3\) or \(3,\)"),
    (lambda: made("rainbow").relative(UP, UP, 500.0), "no relative reflectance"),
    (lambda: made("rainbow").xyz(UP, UP, gain=Gain()), "no relative reflectance"),
    (lambda: swept("weather"), "sweep 'weather' is unknown"),
    (lambda: swept("method", values=["flss", "ray"]), "method='ray' is unknown"),
    (lambda: swept("method", values=[]), "0 values are to be swept"),
    (lambda: swept("wavelength-step", values=[0.0]), "step=0 nm does not fit"),
    (lambda: swept("coherence-width", values=[-5.0]), "coherence_width=-5"),
    (lambda: swept("terms", values=[2.5]), "terms=2.5 must be a whole number"),
    (lambda: swept("terms", method="pq"), "a sweep over terms needs method 'flss'"),
    (lambda: swept("light-angle", values=[120.0]), "theta=120 must be"),
    (lambda: swept("method", values=["rainbow"], gain=Gain()), "no relative reflectance"),
    (lambda: Beam(90.0), "theta=90 must be at least 0 and below 90"),
    (lambda: Beam(30.0, 400.0), "phi=400 must be from -360 to 360"),
    (lambda: ridge(wavelengths=np.array([500.0])), "too few; widen"),
    (lambda: ridge(angles=np.linspace(-95.0, 0.0, 20)), "above -90 and below 90"),
    (lambda: ridge(order=0), "order=0"),
    (lambda: fit_period(ridge(FLAT)), r"0 of 21 wavelengths have a maximum.*too few"),
]


@pytest.mark.parametrize(("ask", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_what_does_not_fit_is_refused(ask, words):
    refused(ask, words)
