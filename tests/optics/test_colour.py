"""Colours: white points, transfer curve, differences, tints; and the view `natural`."""

from __future__ import annotations

import colour
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.colour import (
    ILLUMINANTS,
    RGB_WAVELENGTHS,
    daylight_shares,
    delta_e,
    encode_srgb,
    linear_srgb,
    metal_tint,
    response,
)
from mitsuba_diffraction.optics.display import natural, shown

EVERY_NM = np.arange(360.0, 831.0)


@pytest.mark.parametrize("illuminant", ILLUMINANTS)
def test_the_tables_are_those_of_colour_science(illuminant):
    name = "CIE 1931 2 Degree Standard Observer"
    observer, light = colour.MSDS_CMFS[name], colour.SDS_ILLUMINANTS[illuminant]
    power = np.interp(observer.wavelengths, light.wavelengths, light.values)
    expected = power[:, None] * observer.values
    found = response(observer.wavelengths, illuminant)
    np.testing.assert_allclose(found * expected[:, 1].sum(), expected, rtol=1e-13)  # rounding
    white = colour.CCS_ILLUMINANTS[name][illuminant]
    matrix = colour.XYZ_to_sRGB(np.eye(3), white, apply_cctf_encoding=False)
    np.testing.assert_allclose(linear_srgb(np.eye(3), illuminant), matrix, atol=1e-15)


def test_the_observer_is_blind_beyond_the_visible():
    np.testing.assert_array_equal(response([359.9, 830.1, 100.0, 2000.0]), 0.0)


def test_the_wavelengths_of_rgb_are_the_means_of_its_channels():
    weights = linear_srgb(response(EVERY_NM))
    means = (weights * EVERY_NM[:, None]).sum(axis=0) / weights.sum(axis=0)
    assert RGB_WAVELENGTHS == pytest.approx(means, abs=0.1)


def test_a_spectrum_s_colour_is_a_sum_over_the_wavelengths_that_it_is_known_at():
    lam = np.geomspace(380.0, 760.0, 9)
    weights = linear_srgb(response(EVERY_NM))
    exact = np.interp(np.log(EVERY_NM), np.log(lam), np.sqrt(lam)) @ weights / weights.sum(axis=0)
    assert np.sqrt(lam) @ daylight_shares(lam) == pytest.approx(exact, rel=1e-4)  # steps of 2 nm


def test_the_transfer_curve_is_that_of_srgb():
    # IEC 61966-2-1: 12.92 x up to 0.0031308, 1.055 x^(1/2.4) − 0.055 above; five digits by hand
    given = [-1.0, 0.0, 0.002, 0.18, 0.5, 1.0, 7.0]
    expected = [0.0, 0.0, 0.02584, 0.46136, 0.73536, 1.0, 1.0]
    np.testing.assert_allclose(encode_srgb(given), expected, atol=1e-5)


def test_an_unknown_illuminant_is_refused():
    with pytest.raises(DiffractionError, match=r"illuminant='A' is unknown; choose one of D65, E"):
        response(500.0, "A")


def test_the_difference_of_greys_is_that_of_their_lightness():
    # ΔE2000 without chroma: ΔL'/S_L (Sharma, Wu and Dalal 2005, eqs. 8 and 15); L* as in CIE 15
    y = np.array([0.3, 0.4])
    lightness = 116.0 * np.cbrt(y) - 16.0
    off = (lightness.mean() - 50.0) ** 2
    expected = np.diff(lightness)[0] / (1.0 + 0.015 * off / np.sqrt(20.0 + off))
    found = delta_e([[y[0]] * 3], [[y[1]] * 3], exposure=1.0)
    assert found[0] == pytest.approx(expected, rel=2e-3)  # sRGB's published matrix has four digits


def test_what_is_dark_or_clipped_does_not_count():
    reference = np.array([[0.001] * 3, [1.0] * 3, [5.0, 5.0, 5.0]])
    other = np.array([[0.009] * 3, [1.0] * 3, [9.0, 7.0, 8.0]])
    found = delta_e(reference, other, exposure=1.0)
    assert np.isnan(found[0])
    np.testing.assert_allclose(found[1:], 0.0, atol=1e-9)


def test_the_exposure_shows_the_95th_percentile_as_white():
    reference = np.linspace(0.0, 200.0, 101)[:, None] * np.ones(3)
    assert np.nanmax(delta_e(reference, 1.02 * reference)) > 0.2
    # above the percentile both are white
    np.testing.assert_allclose(delta_e(reference, 1.02 * reference)[-5:], 0.0, atol=1e-9)


def test_the_tint_of_a_metal_is_right_for_white_and_better_for_lines():
    """A step of reflectance within green, as gold's; random sums of lines 40 nm wide."""
    gold = 0.4 + 0.5 / (1.0 + np.exp((510.0 - EVERY_NM) / 15.0))
    lines = linear_srgb(response(EVERY_NM))
    channels = gold @ lines / lines.sum(axis=0)
    tint = metal_tint(EVERY_NM, gold, channels)
    white = lines.sum(axis=0)
    np.testing.assert_allclose(tint @ (channels * white), gold @ lines, rtol=1e-12)
    centres = np.random.default_rng(3).uniform(420.0, 680.0, 200)
    light = np.exp(-0.5 * ((EVERY_NM - centres[:, None]) / 17.0) ** 2)
    truth, plain = (light * gold) @ lines, light @ lines * channels
    errors = [np.abs(found - truth).sum() for found in (plain @ tint.T, plain)]
    assert errors[0] < 0.7 * errors[1]  # 0.60 of it


def test_what_reflects_evenly_or_nothing_has_no_tint():
    even = np.full(len(EVERY_NM), 0.3)
    np.testing.assert_allclose(metal_tint(EVERY_NM, even, [0.3] * 3), np.eye(3), atol=1e-12)
    np.testing.assert_array_equal(metal_tint(EVERY_NM, 0.0 * even, np.zeros(3)), np.eye(3))


# beyond them lines of the spectrum have nearly one chromaticity, and no order
WAVELENGTHS = np.arange(420.0, 681.0, 4.0)
STOPS = np.arange(-15.0, 16.0)


def spectrum(stops):
    """Lines of one luminance, that of grey at 0 stops, linear sRGB with negative components."""
    lines = linear_srgb(response(WAVELENGTHS))
    return 0.18 * 2.0**stops * lines / (lines @ [0.2126, 0.7152, 0.0722])[:, None]


@pytest.mark.parametrize("stops", STOPS)
def test_a_spectrum_keeps_the_order_of_its_hues_at_any_exposure(stops):
    lab = colour.XYZ_to_Oklab(colour.sRGB_to_XYZ(encode_srgb(natural(spectrum(stops)))))
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    steps = -np.diff(np.unwrap(np.arctan2(lab[:, 2], lab[:, 1])))
    coloured = np.minimum(chroma[1:], chroma[:-1]) > 0.02  # a hue that an eye can tell from grey
    # from blue over green to red; 0.5° is far below what an eye tells apart
    assert (steps[coloured] > -np.radians(0.5)).all()
    if -4 <= stops <= 4:
        assert np.ptp(np.cumsum(steps[coloured])) > np.radians(120)


def test_bright_light_of_any_hue_ends_in_white_and_dark_light_in_black():
    assert natural(spectrum(15.0)).min() > 254.5 / 255
    assert natural(spectrum(-15.0)).max() < 0.5 / 255 / 12.92  # half a step of eight bits


def test_greys_stay_grey_rise_and_the_middle_stays():
    levels = 2.0 ** np.linspace(-14, 8, 200)
    greys = natural(levels[:, None] * np.ones(3))
    assert np.ptp(greys, axis=1).max() < 1e-6  # published matrices have ten digits
    assert (np.diff(greys[:, 1]) >= 0).all()
    np.testing.assert_allclose(natural([0.18] * 3), 0.18, rtol=1e-6)


@given(hnp.arrays(np.float64, (5, 3), elements=st.floats(-1e30, 1e30, allow_subnormal=False)))
def test_any_light_is_within_the_displays_range(linear):
    result = shown(linear)
    assert np.isfinite(result).all()
    assert result.min() >= 0
    assert result.max() <= 1


def test_standard_is_srgb_clipped_and_other_views_are_refused():
    light = spectrum(3.0)
    np.testing.assert_array_equal(shown(light, "standard"), encode_srgb(light))
    with pytest.raises(DiffractionError, match=r"view='film' is unknown; choose one of natural"):
        shown(light, "film")
