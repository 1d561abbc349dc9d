"""Light beside the mirror direction, as a detector of a spectrometer sees it (NumPy only)."""

from __future__ import annotations

import numpy as np

from tests.support.directions import polar

LAMP = polar(30.0, 180.0)
#: Settings of tables that are quick to build.
FAST = {"height_scale_max": 1.0, "wavelength_range": (440.0, 810.0)}


def beside_the_mirror(table, degrees, wavelengths):
    """Reflectance over that of white for a detector of 2° beside the mirror direction."""
    n = np.arange(600)
    radius, turn = np.radians(1.0) * np.sqrt((n + 0.5) / n.size), 2.399963 * n  # even over the disc
    sin, cos = np.sin(np.radians(30.0 + degrees)), np.cos(np.radians(30.0 + degrees))
    axes = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0]])
    wo = np.array([sin, 0.0, cos]) * np.cos(radius)[:, None]
    wo += (np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.sin(radius)[:, None]) @ axes
    each = [(table.brdf(LAMP, wo, lam) * wo[:, 2]).mean() for lam in wavelengths]
    return np.pi * np.array(each) / cos
