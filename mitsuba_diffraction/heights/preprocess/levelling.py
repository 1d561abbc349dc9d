"""Taking out what the instrument put in: tilt, offsets between scan lines, specks of dust."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ...errors import DiffractionError
from ..field import HeightField
from .treatment import Change, changed

# Makes the median absolute deviation of normally distributed heights their standard deviation:
# 1/Φ⁻¹(3/4) (Hampel, Journal of the American Statistical Association 69, 1974).
_MAD_TO_SIGMA = 1.4826


def plane_of(field: HeightField) -> tuple[float, float]:
    """Slopes (∂h/∂x, ∂h/∂y) of the plane that fits the heights best, by least squares.

    On a full grid the centred coordinates are orthogonal, so each slope is a plain projection.
    """
    ny, nx = field.shape
    dx, dy = field.pixel_size
    x = (np.arange(nx) - (nx - 1) / 2) * dx
    y = (np.arange(ny) - (ny - 1) / 2) * dy
    slope_x = float(field.heights.mean(axis=0) @ x / (x @ x))
    slope_y = float(field.heights.mean(axis=1) @ y / (y @ y))
    return slope_x, slope_y


def level_plane(field: HeightField) -> tuple[HeightField, Change]:
    """Subtract the least-squares plane; the mean height stays.

    Figures: `tilt_x`, `tilt_y`, how much the plane rises across the patch, µm.
    """
    heights, tilt_x, tilt_y = _without_plane(field)
    what = f"plane removed: it rose {tilt_x:.3g} µm along x and {tilt_y:.3g} µm along y"
    return changed(field, heights, what, tilt_x=tilt_x, tilt_y=tilt_y)


def level_lines(field: HeightField) -> tuple[HeightField, Change]:
    """Subtract each row's median (scan lines run along x), then the plane that is left.

    What is alike along a whole row is lost with the offsets: ridges parallel to x, above all.
    Figures: `line_rms`, the standard deviation of the offsets, and the plane's `tilt_x`, `tilt_y`,
    all in µm.
    """
    medians = np.median(field.heights, axis=1)
    aligned = HeightField(
        field.heights - (medians - medians.mean())[:, None], field.pixel_size, name=field.name
    )
    heights, tilt_x, tilt_y = _without_plane(aligned)
    line_rms = float(medians.std())
    what = (
        f"scan lines aligned by their medians, which scattered by {line_rms:.3g} µm RMS, and the "
        f"plane removed, which rose {tilt_x:.3g} µm along x and {tilt_y:.3g} µm along y"
    )
    return changed(field, heights, what, line_rms=line_rms, tilt_x=tilt_x, tilt_y=tilt_y)


def clip_outliers(field: HeightField, sigmas: float) -> tuple[HeightField, Change]:
    """Cut off heights further than `sigmas` robust standard deviations from the median.

    The deviation is 1.4826 times the median absolute deviation, which dust does not move.
    Figures: `points` clipped, the limits `low` and `high`, and `largest`, the most that one point
    moved, µm.

    Raises
    ------
    DiffractionError
        If `sigmas` is not at least 1, or more than half of the heights are equal, so that there is
        no deviation to measure outliers by.
    """
    if not 1 <= sigmas < math.inf:
        raise DiffractionError(
            f"clip: expected how many standard deviations to keep, at least 1, got {sigmas!r}"
        )
    middle = float(np.median(field.heights))
    sigma = _MAD_TO_SIGMA * float(np.median(np.abs(field.heights - middle)))
    if sigma == 0 and field.range > 0:
        raise DiffractionError(
            f"{field.name}: clip cannot tell outliers, as more than half of the heights are equal; "
            "leave clip out"
        )
    low, high = middle - sigmas * sigma, middle + sigmas * sigma
    heights = np.clip(field.heights, low, high)
    moved = np.abs(heights - field.heights)
    points, largest = int(np.count_nonzero(moved)), float(moved.max())
    limit = f"{sigmas:g} robust standard deviations of {sigma:.3g} µm"
    what = (
        f"{points} of {heights.size} points clipped to {limit}, the furthest by {largest:.3g} µm"
        if points
        else f"nothing to clip: all points are within {limit}"
    )
    return changed(field, heights, what, points=points, low=low, high=high, largest=largest)


def _without_plane(field: HeightField) -> tuple[npt.NDArray[np.float64], float, float]:
    """Heights without the best plane, and its rise across the patch along x and y in µm."""
    ny, nx = field.shape
    dx, dy = field.pixel_size
    slope_x, slope_y = plane_of(field)
    x = (np.arange(nx) - (nx - 1) / 2) * dx
    y = (np.arange(ny) - (ny - 1) / 2) * dy
    heights = field.heights - slope_x * x - (slope_y * y)[:, None]
    return heights, slope_x * field.extent[0], slope_y * field.extent[1]
