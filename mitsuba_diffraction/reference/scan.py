"""Orders of a scan, which is a part of a larger surface and does not tile the plane.

A scan is seen through windows of width W, half overlapping, over which powers are averaged (Welch,
IEEE Transactions on Audio and Electroacoustics 15, 70, 1967). With t(r) = exp(−r²/2σ_t²) about the
middle of a window and s = exp(iκh), order 0 is a_0 = Σ t² s / Σ t². The other orders are DFTs of

    f = c t (s − a_0)   in the window, 0 around it up to 2W,   Σ_j |a_j|² = 1 over all orders,

which sets c: nearly √(1/mean t²), by Parseval, but for the bin j = 0, where a_0 replaces f's. Their
lobe exp(−σ_l²|q − q_j|²) has 1/σ_l² + 1/σ_t² = 1/σ²: the transform of t² under σ_l is as wide as
that of the light's window σ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..heights.coherence import window_corners, window_places
from ..heights.field import HeightField
from ..heights.preprocess import plane_of

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
#: t along y and along x; None along an axis without change of height, which tiles.
Tapers = tuple[Real | None, Real | None]


class ScanWindows(NamedTuple):
    """Width W of the windows of a scan, and σ_t of their taper, µm."""

    width: float
    taper: float


def parts(field: HeightField, windows: ScanWindows | None) -> list[Real]:
    """Heights (ny, nx) of the windows, µm; of the whole patch, without, if it tiles the plane."""
    if windows is None:
        return [field.heights]
    (rows, ny), (columns, nx) = _places(field, windows.width)
    cuts = [field.heights[y : y + ny, x : x + nx] for y, x in window_corners(rows, columns)]
    dx, dy = field.pixel_size
    levelled = []
    for heights in cuts:
        slope_x, slope_y = plane_of(HeightField(heights, field.pixel_size))
        # a scan of one window has been levelled, or is not to be
        tilt_x = slope_x * dx * np.arange(nx) * (len(columns) > 1)
        tilt_y = slope_y * dy * np.arange(ny) * (len(rows) > 1)
        levelled.append(heights - tilt_x - tilt_y[:, None])
    return levelled


def tapers(field: HeightField, windows: ScanWindows | None) -> Tapers | None:
    """Tapers of the windows; None if the patch tiles the plane."""
    if windows is None:
        return None
    dx, dy = field.pixel_size
    found: list[Real | None] = []
    for axis, pixel, (_, n) in zip((0, 1), (dy, dx), _places(field, windows.width), strict=True):
        x = pixel * (np.arange(n) - 0.5 * (n - 1))
        fades = field.varies_along(axis)
        found.append(np.exp(-0.5 * (x / windows.taper) ** 2) if fades else None)
    return found[0], found[1]


def faded(screen: Complex, along: Tapers | None) -> tuple[Complex, complex | None]:
    """Return f with the zeros around it, and a_0; the screen itself and None without tapers."""
    if along is None:
        return screen, None
    t_y, t_x = (np.ones(n) if t is None else t for n, t in zip(screen.shape, along, strict=True))
    t = np.outer(t_y, t_x)
    mean = complex(np.sum(t**2 * screen) / np.sum(t**2))
    pads = (1 if taper is None else 2 for taper in along)
    shape = [n * pad for n, pad in zip(screen.shape, pads, strict=True)]
    rest = np.zeros(shape, np.complex128)
    rest[: screen.shape[0], : screen.shape[1]] = t * (screen - mean)
    power = np.mean(np.abs(rest) ** 2) - abs(np.mean(rest)) ** 2
    return rest * np.sqrt(max(1.0 - abs(mean) ** 2, 0.0) / max(power, 1e-300)), mean


def _places(
    field: HeightField, width: float
) -> tuple[tuple[list[int], int], tuple[list[int], int]]:
    """First pixels and length of the windows along y and x."""
    (ny, nx), (dx, dy) = field.shape, field.pixel_size
    along_y, along_x = (
        window_places(n, width / pixel) if field.varies_along(axis) else ([0], n)
        for axis, n, pixel in ((0, ny, dy), (1, nx, dx))
    )
    return along_y, along_x
