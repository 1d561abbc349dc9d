"""Taking out what the instrument put in: tilt, offsets between scan lines, specks of dust."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ...errors import DiffractionError
from ..field import LARGE, ROWS, HeightField

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


def level_plane(field: HeightField) -> HeightField:
    """Subtract the least-squares plane; the mean height stays."""
    heights, tilt_x, tilt_y = _without_plane(field)
    what = f"plane removed: it rose {tilt_x:.3g} µm along x and {tilt_y:.3g} µm along y"
    return field.changed(heights, what + rms_change(field, heights))


def level_lines(field: HeightField) -> HeightField:
    """Subtract each row's median (scan lines run along x), then the plane that is left.

    What is alike along a whole row is lost with the offsets: ridges parallel to x, above all.
    """
    medians = np.median(field.heights, axis=1)
    aligned = HeightField(
        field.heights - (medians - medians.mean())[:, None], field.pixel_size, name=field.name
    )
    heights, tilt_x, tilt_y = _without_plane(aligned)
    what = (
        f"scan lines aligned by their medians, which scattered by {medians.std():.3g} µm RMS, and "
        f"the plane removed, which rose {tilt_x:.3g} µm along x and {tilt_y:.3g} µm along y"
    )
    return field.changed(heights, what + rms_change(field, heights))


def clip_outliers(field: HeightField, sigmas: float) -> HeightField:
    """Cut off heights further than `sigmas` robust standard deviations from the median.

    The deviation is 1.4826 times the median absolute deviation, which dust does not move.

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
    heights = np.clip(field.heights, middle - sigmas * sigma, middle + sigmas * sigma)
    moved = np.abs(heights - field.heights)
    points = np.count_nonzero(moved)
    limit = f"{sigmas:g} robust standard deviations of {sigma:.3g} µm"
    what = (
        f"{points} of {heights.size} points clipped to {limit}, "
        f"the furthest by {moved.max():.3g} µm"
        if points
        else f"nothing to clip: all points are within {limit}"
    )
    return field.changed(heights, what + rms_change(field, heights))


def rms_change(field: HeightField, heights: npt.NDArray[np.float64]) -> str:
    """The end of a history line: RMS change of height, not counting an offset."""
    if heights.size <= LARGE:
        change = float((heights - field.heights).std())
    else:  # in parts, without a copy
        starts = range(0, len(heights), ROWS)
        rows = [slice(start, start + ROWS) for start in starts]
        mean = float(heights.mean()) - float(field.heights.mean())
        squares = sum(float(np.square(heights[r] - field.heights[r] - mean).sum()) for r in rows)
        change = math.sqrt(squares / heights.size)
    return f"; RMS change {change:.3g} µm"


def _without_plane(field: HeightField) -> tuple[npt.NDArray[np.float64], float, float]:
    """Heights without the best plane, and its rise across the patch along x and y in µm."""
    ny, nx = field.shape
    dx, dy = field.pixel_size
    slope_x, slope_y = plane_of(field)
    x = (np.arange(nx) - (nx - 1) / 2) * dx
    y = (np.arange(ny) - (ny - 1) / 2) * dy
    heights = field.heights - slope_x * x
    heights -= (slope_y * y)[:, None]
    heights.setflags(write=False)  # so that a HeightField need not copy it
    return heights, slope_x * field.extent[0], slope_y * field.extent[1]
