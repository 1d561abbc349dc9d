"""Sheets of fingers laid over one another, as a probe that cannot see beneath them feels them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .fingers import Row
from .noise import FloatArray

# A sheet is drawn until it is this many lengths from its tips; by then others lie over it.
_DRAWN = 2.35


@dataclass(frozen=True)
class Blade:
    """Shape of a finger and of the sheet that it grows from; heights in µm below its crest.

    t is the distance from the tip over the finger's length: 1 is at the tip line of the next row,
    whose fingers cover the sheet beyond.
    """

    notch: float  # where the notches end, in t
    tip_width: float  # half width just behind the rounded tip, over the pitch
    taper: float  # how much it widens from there to the notch, the flare at the notch left out
    tip_round: float  # length of the rounded tip, in t
    tip_drop: float  # how much lower the crest is at the tip than in the middle
    root_drop: float  # the same at t = 1
    side_drop: float  # from the crest to the edge
    root_side: float  # the same at t = 1
    floor: float  # depth of the sheet beneath the next row, at t = 1
    floor_slope: float  # how much deeper at t = 2
    pocket: float  # additional depth of the floor where the next notch ends
    sink: float  # where the sheet begins to go under, in t
    lag: float  # how much later its crest does
    dive: float  # how long it takes to reach the floor
    wall: float  # steepest descent at an edge: the probe's flank, not the finger's


def overlay(
    rows: list[Row], extent: tuple[float, float], serration: FloatArray, blade: Blade
) -> tuple[FloatArray, FloatArray]:
    """Upper envelope of all sheets over the patch and the distance to the next edge above.

    `serration` (ny, nx) displaces edges sideways, in µm; its shape is that of the results.

    Returns
    -------
    heights, distance
        µm, both (ny, nx). Heights are 0 on a crest; the distance is measured across, from the floor
        between two fingers to the nearer of them, and 0 on fingers.
    """
    ny, nx = serration.shape
    distance = np.zeros((ny, nx))
    heights = np.full((ny, nx), -blade.floor - blade.floor_slope - blade.pocket)
    x = np.arange(nx) * (extent[0] / nx)
    for row in rows:
        _lay(heights, distance, row, x, extent, serration, blade)
    return heights, distance


def _lay(
    heights: FloatArray,
    distance: FloatArray,
    row: Row,
    x: FloatArray,
    extent: tuple[float, float],
    serration: FloatArray,
    blade: Blade,
) -> None:
    """Lay one row's sheet over `heights` (ny, nx), and note where its fingers leave gaps."""
    ny, nx = heights.shape
    width, dy = extent[0], extent[1] / ny
    n = row.x.size
    # three more fingers on both sides: a column that leans may reach across the seam
    around = np.arange(-3, n + 3)
    centres = row.x[around % n] + width * (around // n)
    gaps = (np.roll(row.x, -1) - np.roll(row.x, 1)) % (width if n > 2 else math.inf)
    density = 2 / gaps if n > 2 else np.full(n, n / width)

    def along(values: FloatArray) -> FloatArray:
        return np.interp(x, centres, values[around % n])

    place = np.interp(x, centres, around.astype(np.float64))
    pitch = 1 / along(density)
    shear = along(row.lean) / pitch
    start = along(row.y)  # about where the tips are
    margin = float(np.abs(row.y - np.roll(row.y, 1)).max()) / 2 + 0.1
    top = np.floor((start + margin) / dy).astype(np.intp)
    count = math.ceil((_DRAWN * float(row.length.max()) + margin) / dy)
    columns = np.arange(nx)
    for first in range(0, count, ny):  # a patch shorter than a sheet is covered in turns
        k = np.arange(first, min(first + ny, count))[:, None]
        iy = (top - k) % ny
        y = (top - k) * dy
        p = place - shear * (start - y)
        left = np.floor(p).astype(np.intp)
        f = p - left
        # values of one finger hold around its axis; half way to the next they change smoothly
        s = ramp(0.2, 0.8, f)
        a, b = left % n, (left + 1) % n
        length = row.length[a] + s * (row.length[b] - row.length[a])
        tip = row.y[a] + s * (row.y[b] - row.y[a])
        rise = row.rise[a] + s * (row.rise[b] - row.rise[a])
        u = np.minimum(f, 1 - f)
        z, gap = _profile(u, (tip - y) / length, pitch, length, serration[iy, columns], blade)
        distance[iy, columns] += gap
        heights[iy, columns] = np.maximum(heights[iy, columns], z + rise)


def _profile(
    u: FloatArray,
    t: FloatArray,
    pitch: FloatArray,
    length: FloatArray,
    serration: FloatArray,
    blade: Blade,
) -> tuple[FloatArray, FloatArray]:
    """Height of a sheet relative to its crest, and how far outside a finger's sides, µm.

    u is the distance from the finger's axis over the pitch, 0 to ½; t as in `Blade`.
    """
    behind = np.maximum(t, 0.0)
    rounded = 1 - np.minimum(behind / blade.tip_round, 1)
    to_notch = np.minimum(behind / blade.notch, 1)
    half = blade.tip_width * np.sqrt(1 - rounded * rounded) + blade.taper * to_notch
    flare = np.square(to_notch * to_notch * to_notch)
    half += (0.5 - blade.tip_width - blade.taper) * flare  # ½ at the notch
    q = np.minimum(u / np.maximum(half, 0.02), 1.2)
    crest = -blade.tip_drop * np.maximum(1 - 2 * behind, 0) ** 2
    crest -= blade.root_drop * np.clip(2 * behind - 1, 0, 1) ** 2
    root = ramp(0.6, 1.0, to_notch)
    # a roof with a rounded ridge, which becomes a vault at the notch
    roof = (1 - root) * (np.sqrt(q * q + 0.02) - 0.14) / 0.87 + root * q * q
    roof *= blade.side_drop + (blade.root_side - blade.side_drop) * root
    finger = crest - roof
    beneath = np.clip(behind - 1, 0, 1)
    floor = -blade.floor - blade.floor_slope * beneath
    end = 1 + blade.notch  # of the notches in the next sheet, if its fingers are as long
    pocket = ramp(end - 0.35, end - 0.02, behind) * np.exp(-(((0.5 - u) / 0.1) ** 2))
    floor -= blade.pocket * pocket
    # the sheet goes under, the web between the notches before the crest
    dive = ramp(0.0, blade.dive, behind - blade.sink - blade.lag * (1 - 2 * u))
    z = finger + dive * (floor - finger)
    outside = np.where(behind < blade.notch, np.maximum((u - half) * pitch + serration, 0), 0)
    before = np.maximum(-t, 0) * length
    z -= blade.wall * np.hypot(outside, before)
    return z, np.where(t > 0, outside, 0)


def ramp(low: float, high: float, value: FloatArray) -> FloatArray:
    """0 below `low`, 1 above `high`, smooth between (Hermite's cubic)."""
    s = np.clip((value - low) / (high - low), 0.0, 1.0)
    return s * s * (3 - 2 * s)
