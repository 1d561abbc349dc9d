"""Lobes that the horizon cuts: the share above it, and means over that share."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from mitsuba_diffraction.optics.lobes import lobe_means


def test_means_over_a_cut_lobe_are_those_of_its_gaussian():
    width, radius = 0.06, np.array([0.7, 0.92, 0.98, 1.0, 1.05])
    sine = 1.0 - (np.arange(20000) + 0.5) / 20000 * 0.6
    lobe = np.exp(-(((sine - radius[:, None]) / width) ** 2)) * (0.6 / 20000)
    visible, cosine = lobe.sum(axis=1), np.sqrt(1.0 - sine**2)
    found = lobe_means(width, radius)
    # tables of 96 places
    assert_allclose(found.visible, visible / (np.sqrt(np.pi) * width), atol=3e-3)
    assert_allclose(found.cosine, lobe @ cosine / visible, atol=3e-3)
    assert_allclose(found.pole[1:], (lobe @ (1.0 / cosine) / visible)[1:], rtol=0.02)
