"""Random lines."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, gratings


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
    "wrong", [{"width": 0.1}, {"length": 6.0, "period": 0.2}, {"length": 20.0}, {"rms": -1.0}]
)
def test_lines_that_pixels_do_not_show_are_refused(wrong):
    with pytest.raises(DiffractionError, match=f"brushed: {list(wrong)[-1]}"):
        gratings.brushed(32.0, 256, **wrong)
