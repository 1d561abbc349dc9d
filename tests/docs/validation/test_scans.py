"""Scans have the hues of the closed form, and crops of a rough surface the light of the whole."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import scans, tapers


@pytest.mark.parametrize(
    ("side", "periods", "turn", "order"),
    [(10.0, 10.5, 0.0, 1), (10.0, 10.3, 1.0, 1), (12.9, 17.97, 8.9, 1), (20.0, 5.27, 30.0, 4)],
)
def test_a_grating_s_hue_does_not_depend_on_where_its_scan_ends(side, periods, turn, order):
    found = scans.hue(side, side / periods, turn, order, 1.0)
    assert found.hue == pytest.approx(0.0, abs=0.01)
    assert found.width == pytest.approx(1.0, abs=0.15)


def test_lobes_of_a_narrow_taper_have_the_width_of_two_gaussians():
    widths = tapers.lobe_widths(tapers.Estimator(tapers.gaussian(0.5)), 100)
    # |T|² of σ_t = σ/2 and a look-up of 2σ, with ripples between orders of 2 exp(−4) = 4 %
    assert widths.mean() == pytest.approx(np.sqrt(1 / 0.5**2 + 1 / 2.0**2), rel=0.05)


@pytest.mark.thorough
def test_crops_have_the_light_of_the_whole():
    for found in scans.crops(120, (7.0, 10.0), np.arange(430.0, 801.0, 50.0)):
        # 120 crops whose light scatters by 0.6 have a mean within 6 %
        assert found.seen.ratio == pytest.approx(1.0, abs=0.16)
        assert found.seen.worst < 1.3
