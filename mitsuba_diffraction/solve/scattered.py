"""Interpolation between scattered samples."""

from __future__ import annotations

import contextlib

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.spatial import QhullError

from .stations import Real


def interpolated(points: Real, values: Real, places: Real) -> Real:
    """Interpolate values (n, …) at points (n, axes) linearly; use the nearest value outside."""
    flat = values.reshape(len(values), -1)
    result = NearestNDInterpolator(points, flat)(places)
    with contextlib.suppress(QhullError):  # too few points, or all on a line
        linear = LinearNDInterpolator(points, flat)(places)
        result = np.where(np.isnan(linear), result, linear)
    return np.asarray(result).reshape(*places.shape[:-1], *values.shape[1:])
