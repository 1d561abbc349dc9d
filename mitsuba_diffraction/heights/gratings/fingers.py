"""Fingers of a snake's scale: their positions in irregular columns, and their shape.

The microstructure of many snakes' scales is a staircase of flat cells whose rear edges are drawn
out into fingers that lie over the next cell. A sheet is one row of such fingers around the torus of
the patch; the fingers point to +y. The heights are the upper envelope of all sheets, which is what
a probe measures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ...arrays import Real
from .noise import Pair, Rng, sample_field, smooth_field

# Sweeps that even out the columns around an inserted one, enough to spread the gap over a few
# columns, and the sweep after which columns too close to their neighbour are removed.
_SWEEPS = 60
_THINNING = 40

# Drawn length of a sheet, in finger lengths from the tips; other sheets cover it from there on.
_DRAWN = 2.35


@dataclass(frozen=True)
class Layout:
    """Lattice of fingers and its irregularities; lengths in µm.

    `sway`, `wave` and `rise` are standard deviations of fields that vary over several fingers,
    `jitter_x` and `jitter_y` vary single tips. Fingers vary more from column to column than
    along a column.
    """

    pitch: float  # distance between columns
    row_pitch: float  # distance between rows
    sway: float  # displacement of columns along x
    wave: float  # displacement of rows along y
    wave_reach: tuple[float, float]  # correlation length of `wave`, in columns and in rows
    jitter_x: float
    jitter_y: float
    rise: float  # height of fingers
    faults: float  # columns that begin and end inside the patch, per µm²

    def scaled(self, irregularity: float) -> Layout:
        """Return the same lattice with its irregularities multiplied."""
        names = ("sway", "wave", "jitter_x", "jitter_y", "rise", "faults")
        return replace(self, **{name: irregularity * getattr(self, name) for name in names})


@dataclass(frozen=True)
class FingerRow:
    """Fingers of one sheet, from left to right around the patch; arrays (n,), µm."""

    x: Real  # x of tips, ascending
    y: Real  # y of tips
    lean: Real  # displacement of the axis towards +x per µm from the tip towards −y
    length: Real  # from tip to the tip line of the row below
    rise: Real  # height of the finger above the others


def lay_out(rng: Rng, extent: Pair, layout: Layout) -> list[FingerRow]:
    """Draw rows of fingers that fill the patch of `extent` (Lx, Ly), lowest y first."""
    width, height = extent
    n_rows = max(1, round(height / layout.row_pitch))
    step = height / n_rows
    columns = _columns(rng, extent, n_rows, layout)
    reach = (layout.wave_reach[0] * layout.pitch, layout.wave_reach[1] * layout.row_pitch)
    wave = layout.wave * smooth_field(rng, extent, reach, 3.0)
    rise = layout.rise * smooth_field(rng, extent, (layout.pitch, 8 * layout.row_pitch), 3.0)
    waves = _along_rows(wave, extent, columns)
    tips = [
        r * step + waves[r] + layout.jitter_y * rng.standard_normal(x.size)
        for r, x in enumerate(columns)
    ]
    rises = _along_rows(rise, extent, columns)
    rows = []
    for r, x in enumerate(columns):
        below = r - 1  # below the first row is the last one, a patch's height lower
        near = _nearest(x, columns[below], width)
        drop = tips[r] - tips[below][near] + (height if r == 0 else 0.0)
        length = np.clip(drop, 0.5 * step, 1.7 * step)
        aside = _around(columns[below][near] - x, width)
        aside[np.abs(aside) > 0.6 * layout.pitch] = 0.0  # the column ends here
        rows.append(FingerRow(x, tips[r], aside / length, length, rises[r]))
    return rows


def _columns(rng: Rng, extent: Pair, n_rows: int, layout: Layout) -> list[Real]:
    """Draw the tips' x for each row: even columns and extra ones over some rows, then displaced."""
    width, height = extent
    extra = round(layout.faults * width * height)
    starts = rng.integers(0, n_rows, size=extra)
    spans = rng.integers(1, max(2, n_rows * 2 // 3), size=extra)
    places = width * rng.random(extra)
    n = max(1, round(width / layout.pitch - spans.sum() / n_rows))
    even = (np.arange(n) + 0.5) * (width / n)
    rows = [
        np.sort(np.concatenate([even, places[(r - starts) % n_rows < spans]]))
        for r in range(n_rows)
    ]
    for sweep in range(_SWEEPS if extra else 0):
        rows = [_relaxed(rows, r, width, layout.pitch) for r in range(n_rows)]
        if sweep == _THINNING:
            rows = [_thinned(x, width, 0.65 * layout.pitch) for x in rows]
    sway = layout.sway * smooth_field(rng, extent, (2 * layout.pitch, 10 * layout.row_pitch), 3.0)
    swayed = []
    for x, shift in zip(rows, _along_rows(sway, extent, rows), strict=True):
        moved = x + shift + layout.jitter_x * rng.standard_normal(x.size)
        swayed.append(np.sort(moved % width))
    return swayed


def _along_rows(field: Real, extent: Pair, rows: list[Real]) -> list[Real]:
    """Sample a periodic field at the tips of every row, before rows are displaced."""
    sizes = [x.size for x in rows]
    y = np.repeat(np.arange(len(rows)) * (extent[1] / len(rows)), sizes)
    values = sample_field(field, extent, np.concatenate(rows), y)
    return np.split(values, np.cumsum(sizes)[:-1])


def _relaxed(rows: list[Real], r: int, width: float, pitch: float) -> Real:
    """Move a row's tips towards even gaps and towards the tips above and below."""
    x = rows[r]
    right = np.append(x[1:], x[0] + width)
    left = np.append(x[-1] - width, x[:-1])
    tight = np.minimum(right - x, x - left) < 0.75 * pitch
    move = np.where(tight, 0.6, 0.25) * ((left + right) / 2 - x)
    for other in (rows[r - 1], rows[(r + 1) % len(rows)]):
        aside = _around(other[_nearest(x, other, width)] - x, width)
        move += np.where(np.abs(aside) < 0.6 * pitch, 0.25 * aside, 0.0)
    return np.sort(x + move)


def _thinned(x: Real, width: float, least: float) -> Real:
    """Remove the tips of a row that are closer than `least` to their left neighbour."""
    close = np.diff(x, prepend=x[-1] - width) < least
    close &= ~np.roll(close, 1)  # of three close tips, only the middle one is removed
    return x[~close] if close.any() and not close.all() else x


def _nearest(x: Real, others: Real, width: float) -> npt.NDArray[np.intp]:
    """Return the index of the nearest of `others` (ascending) to each x, around the patch."""
    around = np.concatenate([others[-1:] - width, others, others[:1] + width])
    place = np.searchsorted((around[1:] + around[:-1]) / 2, x)
    return (place - 1) % others.size


def _around(difference: Real, width: float) -> Real:
    """Return the shortest difference between two x around the patch."""
    return difference - width * np.round(difference / width)


@dataclass(frozen=True)
class Blade:
    """Shape of a finger and of the sheet that it grows from; heights in µm below its crest.

    t is the distance from the tip over the finger's length: 1 is at the tip line of the next row,
    whose fingers cover the sheet beyond.
    """

    notch: float  # where the notches end, in t
    tip_width: float  # half width just behind the rounded tip, over the pitch
    taper: float  # increase of that half width up to the notch, without the flare at the notch
    tip_round: float  # length of the rounded tip, in t
    tip_drop: float  # descent of the crest from the middle to the tip
    root_drop: float  # descent of the crest from the middle to t = 1
    side_drop: float  # descent from the crest to the edge
    root_side: float  # descent from the crest to the edge at t = 1
    floor: float  # depth of the sheet beneath the next row, at t = 1
    floor_slope: float  # additional depth at t = 2
    pocket: float  # additional depth of the floor where the next notch ends
    sink: float  # t where the edge of the sheet begins to descend to the floor
    lag: float  # delay in t of the crest's descent
    dive: float  # length in t of the descent to the floor
    wall: float  # steepest descent at an edge: the probe's flank, not the finger's


def overlay(
    rows: list[FingerRow], extent: Pair, serration: Real, blade: Blade
) -> tuple[Real, Real]:
    """Compute the upper envelope of all sheets and the distance of the floor from the fingers.

    `serration` (ny, nx), µm, displaces edges sideways; the results have its shape.

    Returns
    -------
    heights, distance
        µm, both (ny, nx). Heights are 0 on a crest. The distance is measured along x from the floor
        between two fingers to the nearer one, and 0 on fingers.
    """
    ny, nx = serration.shape
    distance = np.zeros((ny, nx))
    heights = np.full((ny, nx), -blade.floor - blade.floor_slope - blade.pocket)
    width, dy, columns = extent[0], extent[1] / ny, np.arange(nx)
    x = columns * (width / nx)
    for row in rows:
        n = row.x.size
        # three more fingers on both sides: a column that leans may reach across the seam
        around = np.arange(-3, n + 3)
        centres = row.x[around % n] + width * (around // n)
        gaps = (np.roll(row.x, -1) - np.roll(row.x, 1)) % (width if n > 2 else math.inf)
        density = 2 / gaps if n > 2 else np.full(n, n / width)
        place = np.interp(x, centres, around.astype(np.float64))
        # start : about where the tips are
        density, lean, start = (
            np.interp(x, centres, values[around % n]) for values in (density, row.lean, row.y)
        )
        pitch = 1 / density
        shear = lean / pitch
        margin = float(np.abs(row.y - np.roll(row.y, 1)).max()) / 2 + 0.1
        top = np.floor((start + margin) / dy).astype(np.intp)
        count = math.ceil((_DRAWN * float(row.length.max()) + margin) / dy)
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
            length, tip, rise = (v[a] + s * (v[b] - v[a]) for v in (row.length, row.y, row.rise))
            u = np.minimum(f, 1 - f)
            z, gap = _profile(u, (tip - y) / length, pitch, length, serration[iy, columns], blade)
            distance[iy, columns] += gap
            heights[iy, columns] = np.maximum(heights[iy, columns], z + rise)
    return heights, distance


def _profile(
    u: Real,
    t: Real,
    pitch: Real,
    length: Real,
    serration: Real,
    blade: Blade,
) -> tuple[Real, Real]:
    """Return the height of a sheet relative to its crest, and the distance from a finger's side.

    Both are in µm. u is the distance from the finger's axis over the pitch, 0 to ½; t as in
    `Blade`."""
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


def ramp(low: float, high: float, value: Real) -> Real:
    """Return 0 below `low`, 1 above `high` and Hermite's cubic between them."""
    s = np.clip((value - low) / (high - low), 0.0, 1.0)
    return s * s * (3 - 2 * s)
