"""Crops of a rough surface have the light of the whole."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import scans

pytestmark = pytest.mark.thorough


def test_crops_have_the_light_of_the_whole():
    for found in scans.crops(120, (7.0, 10.0), np.arange(430.0, 801.0, 50.0)):
        # 120 crops whose light scatters by 0.6 have a mean within 6 %
        assert found.ratio == pytest.approx(1.0, abs=0.16)
        assert found.worst < 1.3
