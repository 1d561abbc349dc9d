"""Treatments of heights before their table is built: crop, fill, level, clip.

Each treatment but filling returns a new `HeightField`, whose `history` has one more line that says
what changed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from ..arrays import Real
from ..errors import DiffractionError
from .field import HeightField, blocks

Size = tuple[float, float]
Region = tuple[float, ...]  # (width, height), or (width, height, x, y), µm

FILLS = ("nearest", "harmonic")

# Largest share of points without data that may be filled: beyond half, the filling and not the
# sample would decide the picture.
LARGEST_SHARE = 0.5
#: Makes the median absolute deviation of normally distributed heights their standard deviation:
#: 1/Φ⁻¹(3/4) (Hampel, Journal of the American Statistical Association 69, 1974).
MAD_TO_SIGMA = 1.4826


def part_of(
    values: npt.NDArray[Any], pixel_size: Size, region: Region, name: str
) -> tuple[npt.NDArray[Any], str]:
    """Return a region of values (ny, nx), and the history line, "" if that is all.

    Raises a DiffractionError if the region leaves the patch, or is less than two pixels wide or
    high.

    Parameters
    ----------
    pixel_size : (dx, dy), µm.
    region : (width, height) of the central region, or (width, height, x, y) of one whose lower left
        corner is at (x, y), µm, met to half a pixel.
    name : name of the patch in errors.
    """
    (ny, nx), (dx, dy) = values.shape, pixel_size
    whole = f"{nx * dx:.4g} x {ny * dy:.4g} µm"
    size, corner = region[:2], region[2:]
    # at most one too many: the quotient may be infinite
    kept = round(min(size[0] / dx, nx + 1)), round(min(size[1] / dy, ny + 1))
    for count, most in zip(kept[::-1], (ny, nx), strict=True):
        if not 2 <= count <= most:
            raise DiffractionError(
                f"{name}: crop to {size[0]:g} x {size[1]:g} µm is "
                f"{'larger than the patch' if count > most else 'less than two pixels'}: the patch "
                f"is {whole} with pixels of {dx:.4g} x {dy:.4g} µm"
            )
    if kept == (nx, ny):
        return values, ""
    left, low, where = (nx - kept[0]) // 2, (ny - kept[1]) // 2, "the middle "
    if corner:
        left, low = round(min(corner[0] / dx, nx)), round(min(corner[1] / dy, ny))
        where = ""
        if left + kept[0] > nx or low + kept[1] > ny:
            raise DiffractionError(
                f"{name}: crop to {size[0]:g} x {size[1]:g} µm from ({corner[0]:g}, {corner[1]:g}) "
                f"leaves the patch, which is {whole}"
            )
    line = (
        f"cropped to {where}{kept[0] * dx:.4g} x {kept[1] * dy:.4g} µm of {whole} "
        f"({kept[0]} x {kept[1]} of {nx} x {ny} pixels"
        f"{f', from {left}, {low}' if corner else ''})"
    )
    return values[low : low + kept[1], left : left + kept[0]], line


def crop(field: HeightField, region: Region) -> HeightField:
    """Crop to a region, as in `part_of`, and mark the patch `cut_out`."""
    heights, line = part_of(field.heights, field.pixel_size, region, field.name)
    return field.changed(heights, line, cut_out=True, periodic=False) if line else field


def fill_missing(heights: Real, method: str | None, name: str) -> tuple[Real, str]:
    """Replace NaN and infinite heights by heights interpolated or extended from the points around.

    Raises a DiffractionError if points are missing and `method` is `None`, or more than half of
    them are.

    Parameters
    ----------
    heights
        Shape (ny, nx); points without data are NaN or infinite.
    method
        "nearest": the height of a nearest measured point. "harmonic": the membrane spanned over
        each gap, ∇²h = 0 with the measured border and free edges of the patch. `None` refuses.
    name
        Name of the patch in errors.

    Returns
    -------
    Real, str
        The filled heights, and a line that says how many points were filled; "" if none were.
    """
    missing = ~np.isfinite(heights)
    count = int(np.count_nonzero(missing))
    if count == 0:
        return heights, ""
    share = f"{count} of {heights.size} points ({count / heights.size:.2g} of all)"
    if count == heights.size:
        raise DiffractionError(f"{name}: no height is a finite number; the patch is empty")
    if method is None:
        raise DiffractionError(
            f"{name}: {share} have no height (NaN, infinite or masked); fill them, "
            f"fill={' or fill='.join(FILLS)}, or keep a middle without them, crop=W,H in µm"
        )
    if count > LARGEST_SHARE * heights.size:
        raise DiffractionError(f"{name}: {share} have no height, too many to fill; crop the patch")
    nearest = scipy.ndimage.distance_transform_edt(
        missing, return_distances=False, return_indices=True
    )
    filled = heights[tuple(nearest)]
    if method == "harmonic":
        filled = _harmonic(filled, missing)
    return filled, f"{share} had no height and were filled, method {method}"


def _harmonic(start: Real, missing: npt.NDArray[np.bool_]) -> Real:
    """Solve Laplace's equation on the missing points by conjugate gradients, from `start`.

    The five-point Laplacian with free edges is symmetric and, with a measured point anywhere,
    positive definite; iterations grow with the width of the gaps, not with their number.
    """
    rows, columns = np.nonzero(missing)
    ny, nx = missing.shape
    count = rows.size
    index = np.full(missing.shape, -1)
    index[missing] = np.arange(count)
    degree, measured = np.zeros(count), np.zeros(count)
    links = []  # pairs of neighbouring missing points
    for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        r, c = rows + down, columns + right
        inside = np.nonzero((r >= 0) & (r < ny) & (c >= 0) & (c < nx))[0]
        degree[inside] += 1
        r, c = r[inside], c[inside]
        known = ~missing[r, c]
        measured[inside[known]] += start[r[known], c[known]]
        links.append((inside[~known], index[r[~known], c[~known]]))
    point, neighbour = (np.concatenate(ends) for ends in zip(*links, strict=True))
    adjacency = scipy.sparse.coo_array(
        (np.ones(point.size), (point, neighbour)), shape=(count, count)
    )
    laplacian = (scipy.sparse.diags_array(degree) - adjacency).tocsr()
    if not np.any(laplacian @ start[missing] - measured):
        return start  # conjugate gradients would divide by this residual of 0
    # rtol: heights are stored as float32 at best, 1e-7 of their size; 1e-9 is well below that
    solution, failed = scipy.sparse.linalg.cg(
        laplacian, measured, x0=start[missing], rtol=1e-9, maxiter=10 * (ny + nx)
    )
    if failed:
        raise DiffractionError("fill: the gaps are too wide for 'harmonic'; use 'nearest'")
    filled = start.copy()
    filled[missing] = solution
    return filled


def hann(field: HeightField) -> tuple[Real, Real]:
    """Return Hann windows of the pixels along y (ny,) and x (nx,), above 0 at their ends."""
    ny, nx = field.shape
    return np.hanning(ny + 2)[1:-1], np.hanning(nx + 2)[1:-1]


def plane_of(
    field: HeightField, tapers: tuple[Real | None, Real | None] = (None, None)
) -> tuple[float, float]:
    """Return the slopes (∂h/∂x, ∂h/∂y) of the least-squares plane.

    On a full grid the centred coordinates are orthogonal, so each slope is a plain projection.

    tapers : weights of the pixels along y and x, symmetric about the middle; None where all count
        alike.
    """
    x, y = _centred(field)
    along_y, along_x = (
        np.ones(n) if t is None else t for n, t in zip(field.shape, tapers, strict=True)
    )
    slope_x = along_y @ field.heights @ (along_x * x) / (along_y.sum() * (along_x @ x**2))
    slope_y = (along_y * y) @ field.heights @ along_x / (along_x.sum() * (along_y @ y**2))
    return float(slope_x), float(slope_y)


def plane_rise(field: HeightField) -> float:
    """Return the rise of the least-squares plane across the patch, µm."""
    slope_x, slope_y = plane_of(field)
    return math.hypot(slope_x * field.extent[0], slope_y * field.extent[1])


def level_plane(field: HeightField) -> HeightField:
    """Subtract the least-squares plane; the mean height stays."""
    heights, rise = _without_plane(field)
    line = f"plane removed: it rose {rise}{rms_change(field, heights)}"
    return field.changed(heights, line)


def level_quadratic(field: HeightField) -> HeightField:
    """Subtract the least-squares polynomial of degree 2, a scanner's arc; the mean height stays."""
    arc = arc_of(field.heights)
    heights = field.heights - arc
    line = f"paraboloid removed: it spanned {np.ptp(arc):.3g} µm{rms_change(field, heights)}"
    return field.changed(heights, line)


def arc_of(heights: Real) -> Real:
    """Return the least-squares polynomial of degree 2, without its mean, (ny, nx)."""
    bases = []
    for count in heights.shape:
        powers = np.polynomial.legendre.legvander(np.linspace(-1, 1, count), min(2, count - 1))
        bases.append(np.linalg.qr(powers)[0])  # orthonormal on the pixels
    along_y, along_x = bases
    weights = along_y.T @ heights @ along_x
    weights[np.add.outer(*(np.arange(n) for n in weights.shape)) > 2] = 0.0
    weights[0, 0] = 0.0
    return np.asarray(along_y @ weights @ along_x.T)


def level_lines(field: HeightField) -> HeightField:
    """Subtract the median of each row (scan lines run along x), then the remaining plane.

    Ridges parallel to x are lost with the rows' offsets.
    """
    medians = np.median(field.heights, axis=1)
    offsets = (medians - medians.mean())[:, None]
    heights, rise = _without_plane(HeightField(field.heights - offsets, field.pixel_size))
    line = (
        f"scan lines aligned by their medians, which scattered by {medians.std():.3g} µm RMS, and "
        f"the plane removed, which rose {rise}{rms_change(field, heights)}"
    )
    return field.changed(heights, line)


def clip_outliers(field: HeightField, sigmas: float) -> HeightField:
    """Clip heights to `sigmas` robust standard deviations around the median.

    The robust standard deviation is 1.4826 times the median absolute deviation, which a few points
    of dust do not change.

    Raises a DiffractionError if more than half of the heights are equal: the deviation is 0 then.
    """
    median = float(np.median(field.heights))
    sigma = MAD_TO_SIGMA * float(np.median(np.abs(field.heights - median)))
    if sigma == 0 and field.range > 0:
        raise DiffractionError(
            f"{field.name}: clip finds no outliers, since more than half of the heights are equal; "
            "leave clip out"
        )
    heights = np.clip(field.heights, median - sigmas * sigma, median + sigmas * sigma)
    moved = np.abs(heights - field.heights)
    points = np.count_nonzero(moved)
    limit = f"{sigmas:g} robust standard deviations of {sigma:.3g} µm"
    line = (
        f"{points} of {heights.size} points clipped to {limit}, "
        f"the furthest by {moved.max():.3g} µm"
        if points
        else f"no point is clipped: all are within {limit}"
    )
    return field.changed(heights, line + rms_change(field, heights))


def rms_change(field: HeightField, heights: Real) -> str:
    """Return the end of a history line: RMS change of height, a constant offset left out."""
    mean = float(heights.mean()) - float(field.heights.mean())
    pairs = zip(blocks(heights), blocks(field.heights), strict=True)
    squares = sum(float(np.square(new - old - mean).sum()) for new, old in pairs)
    return f"; RMS change {math.sqrt(squares / heights.size):.3g} µm"


def _without_plane(field: HeightField) -> tuple[Real, str]:
    """Return heights without their least-squares plane, and its rise across the patch in words."""
    (x, y), (slope_x, slope_y) = _centred(field), plane_of(field)
    heights = field.heights - slope_x * x
    heights -= (slope_y * y)[:, None]
    heights.setflags(write=False)  # so that a HeightField need not copy it
    rise_x, rise_y = slope_x * field.extent[0], slope_y * field.extent[1]
    return heights, f"{rise_x:.3g} µm along x and {rise_y:.3g} µm along y"


def _centred(field: HeightField) -> tuple[Real, ...]:
    """Return coordinates (nx,) and (ny,) of the samples, µm, 0 in the middle."""
    return tuple(
        (np.arange(count, dtype=np.float64) - (count - 1) / 2) * pixel
        for count, pixel in zip(field.shape[::-1], field.pixel_size, strict=True)
    )
