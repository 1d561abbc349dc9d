"""Hues of scanned gratings are those of the closed form, and crops have the light of the whole."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import scans


@pytest.mark.parametrize(
    ("side", "periods", "turn", "order"),
    [(10.0, 10.5, 0.0, 1), (10.0, 10.3, 1.0, 1), (12.9, 17.97, 8.9, 1), (20.0, 5.27, 30.0, 4)],
)
def test_a_grating_s_hue_does_not_depend_on_where_its_scan_ends(side, periods, turn, order):
    found = scans.hue(side, side / periods, turn, order, 1.0)
    assert found.hue == pytest.approx(0.0, abs=0.01)
    # the window ends where its taper is 0.22, and look-ups ripple between orders
    assert found.width == pytest.approx(1.1, abs=0.15)


@pytest.mark.thorough
def test_crops_have_the_light_of_the_whole():
    for found in scans.crops(60, (7.0, 10.0), np.arange(430.0, 801.0, 50.0)):
        # 60 crops whose light scatters by 0.6 have a mean within 8 %
        assert found.ratio == pytest.approx(1.0, abs=0.16)
        assert found.worst < 1.3
