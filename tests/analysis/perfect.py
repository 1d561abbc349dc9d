"""A perfect mirror's factor on the light of orders."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.analysis.iridescence import Factor
from mitsuba_diffraction.analysis.maps import LightDirection


def perfect(light: LightDirection) -> Factor:
    """Return the factor of R = 1 in air, 1, and w = cosθi + cosθo."""
    return lambda sines, wavelength: (
        np.ones(len(sines)), light.direction[2] + np.sqrt(1.0 - np.square(sines).sum(axis=1))
    )  # fmt: skip
