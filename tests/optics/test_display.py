"""The view `natural`: order of hues, white, grey, and any input."""

from __future__ import annotations

import colour
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.colour import encode_srgb, linear_srgb, response
from mitsuba_diffraction.optics.display import natural, shown

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


def test_colours_of_a_printed_chart_keep_their_hue():
    # 24 patches of the ColorChecker; half of them are nearly grey
    chart = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
    xyz = colour.xyY_to_XYZ(np.array(list(chart.data.values())))
    linear = colour.XYZ_to_sRGB(xyz, chart.illuminant, apply_cctf_encoding=False)
    before, after = (colour.XYZ_to_Oklab(colour.sRGB_to_XYZ(encode_srgb(np.clip(c, 0, 1))))
                     for c in (linear, natural(linear)))  # fmt: skip
    turn = np.angle((after[:, 1] + 1j * after[:, 2]) / (before[:, 1] + 1j * before[:, 2]))
    coloured = np.hypot(before[:, 1], before[:, 2]) > 0.05
    assert np.degrees(np.abs(turn[coloured])).max() < 12  # less than between neighbouring patches


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
