"""Orders of phase screens, eq. (2) of `model`: of a patch that tiles the plane, or of a scan.

A scan is a part of a larger surface. It is seen through windows of width W, half overlapping, over
which powers are averaged (Welch, IEEE Transactions on Audio and Electroacoustics 15, 70, 1967).
With the taper t = t(x) t(y), t(x) = 1 + 0.465 cos(2πx/W) − 0.145 cos(4πx/W) about the middle of a
window, and s = exp(iκh), order 0 is a_0 = Σ t² s / Σ t². The other orders are DFTs of

    f = c t (s − a_0)   in the window, 0 around it up to 2W,   Σ_j |a_j|² = 1 over all orders,

which sets c: nearly √(1/mean t²), by Parseval, but for the bin j = 0, where a_0 replaces f's. Along
each axis neighbours take 0.165 of their power less,

    P_j = |a_j|² − 0.165 (|a_j+1|² − 2|a_j|² + |a_j−1|²),

where |a_0|² is the mean of its neighbours. Lobes are exp(−σ_l²|q − q_j|²) with σ_l = 1.65 σ: a wave
under them is as wide as under the light's window σ = W/4.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Complex, Real
from ..heights import HeightField
from ..heights.coherence import window_corners, window_places
from ..heights.preprocess import plane_of

#: σ_l over σ.
LOOKUP = 1.65
#: t along y and along x; None along an axis without change of height, which tiles.
Tapers = tuple[Real | None, Real | None]


class Sigmas(NamedTuple):
    """σ under which all orders but 0 are summed, and σ₀ of order 0's, the light's; both in µm.

    `windows`: width W, µm, of the windows of a scan, which does not tile the plane.
    """

    orders: float
    zeroth: float
    windows: float | None = None


class Orders(NamedTuple):
    """Orders about q: q_j along x and y, a_j (y, x), and a_0; `tapers`: of a scan's windows."""

    qx: Real
    qy: Real
    a: Complex
    zeroth: complex
    tapers: Tapers | None = None


#: Function of orders about q that returns Σ_j≠0 ⟨|P_j|²⟩ and ⟨|P_0|²⟩ in µm⁴, and the cosine of the
#: phase between both under one window.
Sums = Callable[[Orders, tuple[float, float], Sigmas], tuple[float, float, float]]


def patch_power(
    field: HeightField, kappa: float, q: tuple[float, float], sigmas: Sigmas, sums: Sums
) -> Real:
    """`sums` at q and κ, (3,); means over the windows of a scan."""
    parts, tapers = parts_of(field, sigmas.windows), tapers_of(field, sigmas.windows)
    screens = (np.exp(1j * kappa * part) for part in parts)
    orders = (orders_near(q, sigmas.orders, s, field.pixel_size, tapers) for s in screens)
    others, *rest = np.mean([sums(each, q, sigmas) for each in orders], axis=0)
    return np.array([max(others, 0.0), *rest])  # sharpened powers dip below 0 between strong orders


def orders_near(
    q: tuple[float, float], sigma: float, screen: Complex, pixel_size: tuple[float, float],
    tapers: Tapers | None = None,
) -> Orders:  # fmt: skip
    """Orders (2) of a screen (ny, nx), or of a faded one, that the window about q reaches."""
    screen, zeroth = faded(screen, tapers)
    qx, waves_x = plane_waves(screen.shape[1], pixel_size[0], q[0], sigma)
    qy, waves_y = plane_waves(screen.shape[0], pixel_size[1], q[1], sigma)
    return Orders(qx, qy, waves_y @ screen @ waves_x.T / screen.size, zeroth, tapers)


def plane_waves(n: int, pixel: float, q: float, sigma: float) -> tuple[Real, Complex]:
    """Frequencies q_j of a DFT of n pixels near q, and exp(i q_j x) at the pixels."""
    # exp(−8.6²/2) = 9e-17: amplitudes farther from q are below the last bit of the sum
    spacing, reach = 2 * np.pi / (n * pixel), 8.6 / sigma
    first, last = np.ceil((q - reach) / spacing), np.floor((q + reach) / spacing)
    # A DFT of an even number of points has −n/2 but not +n/2
    j = np.arange(max(first, -(n // 2)), min(last, (n - 1) // 2) + 1)
    turns = np.outer(j, np.arange(n)) % n  # exact integers keep the phase exact
    return j * spacing, np.exp(2j * np.pi / n * turns)


def parts_of(field: HeightField, windows: float | None) -> list[Real]:
    """Heights (ny, nx) of the windows, µm; of the whole patch, without, if it tiles the plane."""
    if windows is None:
        return [field.heights]
    (rows, ny), (columns, nx) = _places(field, windows)
    cuts = [field.heights[y : y + ny, x : x + nx] for y, x in window_corners(rows, columns)]
    dx, dy = field.pixel_size
    tapers = tapers_of(field, windows) or (None, None)
    levelled = []
    for heights in cuts:
        slope_x, slope_y = plane_of(HeightField(heights, field.pixel_size), tapers)
        # a scan of one window has been levelled, or is not to be
        tilt_x = slope_x * dx * np.arange(nx) * (len(columns) > 1)
        tilt_y = slope_y * dy * np.arange(ny) * (len(rows) > 1)
        levelled.append(heights - tilt_x - tilt_y[:, None])
    return levelled


def tapers_of(field: HeightField, windows: float | None) -> Tapers | None:
    """Tapers of the windows; None if the patch tiles the plane."""
    if windows is None:
        return None
    found: list[Real | None] = []
    for axis, (_, n) in enumerate(_places(field, windows)):
        turn = 2 * np.pi / n * (np.arange(n) - 0.5 * (n - 1))
        taper = 1 + 0.465 * np.cos(turn) - 0.145 * np.cos(2 * turn)
        found.append(taper if field.varies_along(axis) else None)
    return found[0], found[1]


def faded(screen: Complex, along: Tapers | None) -> tuple[Complex, complex]:
    """Return f with the zeros around it, and a_0; the screen itself and its mean without tapers."""
    if along is None:
        return screen, complex(screen.mean())
    t_y, t_x = (np.ones(n) if t is None else t for n, t in zip(screen.shape, along, strict=True))
    t = np.outer(t_y, t_x)
    mean = complex(np.sum(t**2 * screen) / np.sum(t**2))
    pads = (1 if taper is None else 2 for taper in along)
    shape = [n * pad for n, pad in zip(screen.shape, pads, strict=True)]
    rest = np.zeros(shape, np.complex128)
    rest[: screen.shape[0], : screen.shape[1]] = t * (screen - mean)
    power = np.mean(np.abs(rest) ** 2) - abs(np.mean(rest)) ** 2
    return rest * np.sqrt(max(1.0 - abs(mean) ** 2, 0.0) / max(power, 1e-300)), mean


def sharpened(
    powers: Real, zeroth: tuple[NDArray[np.bool_], NDArray[np.bool_]], along: Tapers
) -> Real:
    """P_j from |a_j|² (ny, nx); zeroth : where q_j is 0 along y and x. Order 0 stays empty."""
    if not powers.size:  # no order of the patch is near q
        return powers
    empty = np.outer(*zeroth)
    axes = [axis for axis, taper in enumerate(along) if taper is not None]
    if empty.any():
        sides = [np.roll(empty, step, axis) for axis in axes for step in (-1, 1)]
        powers = np.where(empty, np.mean([powers[side].sum() for side in sides]), powers)
    for axis in axes:
        wide = np.pad(powers, [(int(n == axis),) * 2 for n in (0, 1)], mode="edge")
        powers = powers - 0.165 * np.diff(wide, 2, axis=axis)
    return np.where(empty, 0.0, powers)


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
