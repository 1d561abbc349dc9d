"""Random surfaces: the spectrum, RMS and band of rough mirrors, and brushed lines."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, gratings
from mitsuba_diffraction.heights.scatter import power_spectrum


def test_heights_have_the_rms_that_is_asked_for_and_a_k_correlation_spectrum():
    field = gratings.rough(40.0, 256, 3, rms=0.004, correlation=1.5, slope=1.6)
    # heights are rounded to a picometre
    assert field.heights.std() == pytest.approx(0.004, abs=1e-6)
    found = power_spectrum(field)
    model = (1.0 + (2.0 * np.pi * 1.5 * found.frequency) ** 2) ** -1.3
    ratio = found.density / model
    # rings above 1/µm have 600 independent modes and more, which scatter by 4 %; the last is cut
    wide = (found.frequency > 1.0) & (found.frequency < found.frequency[-1])
    assert ratio[wide].std() / ratio[wide].mean() < 0.06


def test_a_fractal_falls_as_a_power_of_the_frequency():
    found = power_spectrum(gratings.rough(40.0, 256, 1, correlation=1e4, slope=1.2))
    wide = found.frequency > 0.2
    exponent = np.polyfit(np.log(found.frequency[wide]), np.log(found.density[wide]), 1)[0]
    assert exponent == pytest.approx(-2.2, abs=0.05)


def test_a_band_holds_all_of_the_power():
    field = gratings.rough(40.0, 256, rms=0.004, band=(1.0, 8.0))
    power = np.abs(np.fft.fft2(field.heights)) ** 2
    axis = np.fft.fftfreq(256, 40.0 / 256)
    radius = np.hypot(axis, axis[:, None])
    inside = (radius >= 1 / 8.0) & (radius <= 1.0)
    # but for rounding to a picometre
    assert power[inside].sum() > (1 - 1e-5) * power.sum()


def spectrum(**arguments):
    field = gratings.brushed(32.0, 256, **arguments)
    return field.heights, np.abs(np.fft.fft2(field.heights)) ** 2


def test_lines_run_along_y_with_the_height_that_is_asked_for():
    heights, _ = spectrum(rms=0.05, width=0.6, length=6.0)
    slopes = [np.diff(heights, axis=axis).std() for axis in (0, 1)]
    # slopes go as the reciprocal of the blur, here 10; 20 lines across give 0.2 of scatter
    assert 7 < slopes[1] / slopes[0] < 13
    # some 15 by 2 independent lines: the estimate scatters by 1 / sqrt(2 · 30)
    assert heights.std() == pytest.approx(0.05, rel=0.4)


def test_the_power_of_a_period_lies_around_its_frequency():
    _, power = spectrum(period=1.0, width=4.0, length=8.0)
    cut = power.sum(axis=0)[:128]
    # σ of the band is 1 / (2π·4 µm), 1.3 of the 1/32 µm between frequencies
    assert cut[28:37].sum() > 0.99 * cut.sum()


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (gratings.rough, {"slope": 9.0}), (gratings.rough, {"rms": -1.0}),
        (gratings.rough, {"band": (0.01, 0.02)}), (gratings.brushed, {"width": 0.1}),
        (gratings.brushed, {"length": 6.0, "period": 0.2}), (gratings.brushed, {"length": 20.0}),
        (gratings.brushed, {"rms": -1.0}),
    ],
)  # fmt: skip
def test_what_the_patch_cannot_hold_is_refused(make, wrong):
    with pytest.raises(DiffractionError, match=f"{make.__name__}: {list(wrong)[-1]}"):
        make(32.0, 256 if make is gratings.brushed else 64, **wrong)
