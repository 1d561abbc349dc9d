"""Ridges follow the grating equation; fits find the period; what cannot be fitted says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError, HeightField
from mitsuba_diffraction.heights import dominant_periods, gratings
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.period_fit import (
    Beam,
    Response,
    find_period,
    fit_period,
    measure,
    ridge_of,
    thesis_fit,
    window_fits,
)
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

WAVELENGTHS = np.arange(380.0, 781.0, 20.0)
ANGLES = np.linspace(-30.0, 75.0, 1051)


@pytest.fixture(scope="module")
def blazed() -> HeightField:
    return gratings.blazed(2.5, 0.25, rows=8)


@pytest.fixture(scope="module")
def of_blazed(blazed):
    return methods.make_all(("spectral", "flss", "nmm", "pq", "pq-sinc"), blazed)


def response_of(method, beam=None, angles=ANGLES, wavelengths=WAVELENGTHS) -> Response:
    return measure(
        method.brdf, beam or Beam(), wavelengths, angles, sigma=method.sigma, label=method.name
    )


@pytest.mark.parametrize("name", ["spectral", "flss", "nmm", "pq", "pq-sinc"])
def test_the_blazed_grating_follows_the_grating_equation(of_blazed, name):
    ridge = ridge_of(response_of(of_blazed[name]))
    expected = Beam().grating_angles(WAVELENGTHS, 2.5, 1)
    assert ridge.has_maximum.all()
    # 0.05° is asked for; nmm knows its λₙ to half a step of 5 nm only, 0.1° here
    allowed = 0.1 if name == "nmm" else 0.05
    assert np.abs(ridge.angles - expected).max() < allowed
    fit = fit_period(ridge)
    assert fit.period == pytest.approx(2.5, rel=1e-3)
    assert fit.points == len(WAVELENGTHS)


def made_up(places, beam=None, wavelengths=WAVELENGTHS, angles=ANGLES, sigma=16.0) -> Response:
    """Lobes of a window at frequencies (n, 1) or one, in rad/µm, of each wavelength."""
    beam = beam or Beam()
    u = beam.sine - np.sin(np.radians(angles))
    values = np.exp(-(sigma**2) * (2e3 * np.pi / wavelengths[:, None] * u - places) ** 2)
    return Response(beam, wavelengths, angles, values, sigma, "made up")


@settings(max_examples=15)
@given(
    st.floats(0.8, 3.0),
    st.floats(0.0, 75.0),
    st.sampled_from([1, -1]),
    st.sampled_from([0.0, 90.0, 180.0]),
)
def test_a_made_up_ridge_is_fitted(period, theta, order, phi):
    beam, angles = Beam(theta, phi), np.linspace(-89.0, 89.0, 3561)
    ridge = ridge_of(made_up(order * 2 * np.pi / period, beam, angles=angles), order)
    within = np.abs(beam.grating_angles(WAVELENGTHS, period, order)) < 85.0
    if within.sum() < 5:
        with pytest.raises(DiffractionError, match="too few to fit a period"):
            fit_period(ridge)
        return
    fit = fit_period(ridge)
    # the parabola is exact in u; in angle it bends by cosθ over a step of 0.05°
    assert fit.period == pytest.approx(period, rel=2e-4)


def test_outliers_do_not_move_the_fit():
    wavelengths = np.arange(380.0, 781.0, 10.0)
    where = np.full((wavelengths.size, 1), 2 * np.pi / 1.2)
    where[5:10] = 2 * np.pi / 0.9
    fit = fit_period(ridge_of(made_up(where, wavelengths=wavelengths)))
    assert fit.period == pytest.approx(1.2, rel=0.01)
    assert fit.largest > 1.0  # and is told


def test_windows_of_a_grating_agree_and_those_of_a_scale_do_not(blazed):
    beam, few = Beam(), WAVELENGTHS[::3]
    table = methods.make("spectral", blazed, coherence="patch").table
    exact = window_fits(table, beam, few, ANGLES, count=4)
    assert exact.spread < 1e-5
    assert exact.mean == pytest.approx(2.5, rel=1e-3)
    scale = gratings.elaphe_like(32.0, 512)
    table = methods.make("spectral", scale, coherence="patch", coherence_width=12.0).table
    found = window_fits(table, beam, few, ANGLES[::2], count=6)
    assert found.spread > 0.01
    assert 0.9 < found.mean < 1.3  # fingers some 1 µm apart


def test_the_thesis_procedure_finds_the_blazed_period(of_blazed, blazed):
    table = methods.make("spectral", blazed, coherence="patch").table
    fit = thesis_fit(table, Beam(), WAVELENGTHS, ANGLES)
    assert fit.period == pytest.approx(2.5, rel=1e-3)  # they report 2500 nm


def test_light_that_follows_no_grating_equation_is_passed_over():
    """A broad and brighter maximum near the mirror, as a bent scale has, beside the grating's."""
    line = (Beam().sine - np.sin(np.radians(ANGLES))) / (WAVELENGTHS[:, None] * 1e-3)
    response = made_up(2 * np.pi / 0.9)
    broad = 3.0 * np.exp(-(((line - 0.15) / 0.05) ** 2))
    response = replace(response, values=response.values + broad)
    assert fit_period(ridge_of(response)).period > 5.0  # what is brightest
    fit = fit_period(ridge_of(response, period=find_period(response, [0.93])))
    assert fit.period == pytest.approx(0.9, rel=1e-3)
    assert find_period(response, [1.5]) is None
    assert find_period(response, []) is None


def test_a_bent_scale_has_the_period_of_its_fingers_across_them_only():
    bending = rough_patch((512, 512), (0.0625, 0.0625), 0.1, correlation=3.0).heights
    heights = gratings.xenopeltis_like(32.0, 512).heights + bending
    bent = HeightField(heights, 0.0625)
    held = [grating.period for grating in dominant_periods(bent)]
    method = methods.make("spectral", bent, tolerance=1e-2)
    response = response_of(method)
    fit = fit_period(ridge_of(response, period=find_period(response, held)))
    assert fit.period == pytest.approx(0.6, rel=0.05)  # 0.6 µm, stretched to fit the patch
    assert fit.residual < 0.5
    assert find_period(response_of(method, beam=Beam(phi=80.0)), held) is None


def test_a_rough_patch_has_no_period_though_one_order_of_its_tile_is_brightest():
    rough = rough_patch((256, 256), (0.1, 0.1), 0.1, seed=4)
    response = response_of(methods.make("spectral", rough, tolerance=1e-2))
    assert fit_period(ridge_of(response)).residual < 0.01  # on a perfect line
    assert find_period(response, [grating.period for grating in dominant_periods(rough)]) is None


def test_the_second_order_is_told_from_the_first(of_blazed):
    response = response_of(of_blazed["flss"])
    assert fit_period(ridge_of(response, 2)).period > 4.0  # that of the brighter first
    period = find_period(response, [2.5], 2)
    fit = fit_period(ridge_of(response, 2, period=period))
    assert fit.period == pytest.approx(2.5, rel=1e-3)
