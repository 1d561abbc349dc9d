"""Hues of scanned gratings are the hues of the closed form."""

from __future__ import annotations

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
