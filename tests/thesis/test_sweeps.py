"""Sweeps: the right values, compared with the right one, and what they have to show."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.analysis.maps import LightDirection
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import Gain
from mitsuba_diffraction.thesis.methods.make import method_map
from mitsuba_diffraction.thesis.sweeps import sweep, time_compiled, truncated

SETTINGS = {"coherence_width": 20.0, "resolution": 24, "samples": 4, "wavelength_range": (400, 700)}


@pytest.fixture(scope="module")
def grating():
    return gratings.blazed(2.0, 0.2, periods=10, rows=16)


def test_finer_steps_come_closer(grating):
    result = sweep(
        "wavelength-step", grating, LightDirection(20.0), values=[2.0, 10.0, 100.0], **SETTINGS
    )
    assert result.reference == "2 nm"
    first, fine, coarse = result.steps
    assert first.difference.delta_e == 0.0
    assert (
        fine.difference.delta_e < 1.0 < coarse.difference.delta_e
    )  # ΔE of 1 is what an eye can just see


def test_more_terms_come_closer(grating):
    result = sweep("terms", grating, LightDirection(20.0), values=[2, 6, 14], **SETTINGS)
    assert result.reference == "14 terms"
    assert result.steps[0].difference.delta_e > 10.0 * result.steps[1].difference.delta_e > 0.0


def test_the_light_s_angle_has_no_reference(grating):
    result = sweep("light-angle", grating, LightDirection(), values=[0.0, 50.0], **SETTINGS)
    assert result.reference is None
    assert np.isnan(result.steps[1].difference.delta_e)
    assert [step.map.light.theta for step in result.steps] == [0.0, 50.0]


def test_wider_windows_make_sharper_lobes(grating):
    result = sweep("coherence-width", grating, LightDirection(20.0), values=[5.0, 20.0], **SETTINGS)
    assert result.reference == "20 µm"
    brightest = [step.map.luminance.max() for step in result.steps]
    assert brightest[0] < 0.5 * brightest[1]


def test_methods_are_compared_with_flss(grating):
    names = ("spectral", "flss", "nmm", "rainbow")
    result = sweep("method", grating, LightDirection(20.0), values=names, **SETTINGS)
    by_name = {step.value: step for step in result.steps}
    # tables of tolerance 1e-3 both
    assert by_name["spectral"].difference.delta_e < 0.1
    assert by_name["nmm"].difference.delta_e > 1.0
    assert by_name["nmm"].difference.blueness > 1.05  # the purple shift
    lobes = sweep(
        "method",
        grating,
        LightDirection(20.0),
        values=["flss", "nmm"],
        nmm_weights="lobe",
        **SETTINGS,
    )
    assert lobes.steps[1].difference.delta_e < 0.5 * by_name["nmm"].difference.delta_e


def test_a_truncated_series_is_the_shorter_series(grating):
    long, short = (
        methods.make("flss", grating, coherence_width=20.0, terms=n, tolerance=0.5) for n in (14, 9)
    )
    cut = truncated(long.table, 9)
    wi, wo = np.array([0.3, 0.0, 0.91**0.5]), np.array([0.1, 0.0, 0.99**0.5])
    expected = short.table.brdf(wi[None], wo[None], 450.0)
    np.testing.assert_allclose(cut.brdf(wi[None], wo[None], 450.0), expected, rtol=1e-5)
    assert truncated(long.table, 99).expansion.terms == 14


def test_relative_maps_are_the_thesis_value(grating):
    method = methods.make("flss", grating, coherence_width=20.0)
    light = LightDirection(20.0)
    found = method_map(method, light, wavelength=500.0, resolution=16, gain=Gain())
    row, column = 8, 11
    x, y = (column + 0.5) / 8 - 1.0, (row + 0.5) / 8 - 1.0
    wo = np.array([x, y, (1 - x * x - y * y) ** 0.5])
    expected = method.relative(light.direction, wo, 500.0)[0]
    assert found.luminance[row, column] == pytest.approx(expected, rel=1e-6)


def test_compiled_flss_and_default_are_timed_side_by_side(grating, some_variant):
    found = time_compiled(
        grating, LightDirection(20.0), resolution=16, samples=1, coherence_width=20.0
    )
    assert found.spectral > 0.0
    assert found.ratio == found.flss / found.spectral
    assert found.colour_ratio == found.flss / found.colours
