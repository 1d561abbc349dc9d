"""Wide scans, of which tables are means over windows."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

PIXEL = 0.1
SETTINGS = {"coherence_width": 6.0, "tolerance": 0.02, "wavelength_range": (500.0, 600.0)}


def rough(n=480, seed=1):
    """Heights of a random periodic surface, (n, n) in µm."""
    heights = gaussian_filter(np.random.default_rng(seed).standard_normal((n, n)), 4, mode="wrap")
    return 0.05 * heights / heights.std()
