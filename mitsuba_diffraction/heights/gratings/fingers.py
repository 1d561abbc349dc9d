"""Where the fingers of a scale stand: rows of tips, in columns that wander, split and end.

The microstructure of many snakes' scales is a staircase of flat cells whose rear edges are drawn
out into fingers that lie over the next cell. Here a sheet is one row of such fingers around the
torus of the patch; the fingers point to +y.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .noise import FloatArray, sample_field, smooth_field

# Sweeps that even out the columns around an inserted one, and the one after which columns that are
# still too close to another are taken out. Enough for what remains to be spread over a few columns.
_SWEEPS = 60
_THINNING = 40


@dataclass(frozen=True)
class Layout:
    """How regular the rows and columns are; lengths in µm.

    `sway`, `wave` and `rise` are standard deviations of fields that vary over several fingers,
    `jitter_x` and `jitter_y` those of single tips. A column differs from the next more than a
    finger from the next one in its column.
    """

    pitch: float  # between columns
    row_pitch: float  # between rows
    sway: float  # of columns, sideways
    wave: float  # of rows, along the fingers
    wave_reach: tuple[float, float]  # correlation length of `wave`, in columns and in rows
    jitter_x: float
    jitter_y: float
    rise: float  # of fingers, up and down
    faults: float  # columns that begin and end inside the patch, per µm²

    def scaled(self, irregularity: float) -> Layout:
        """The same lattice, its irregularities multiplied."""
        names = ("sway", "wave", "jitter_x", "jitter_y", "rise", "faults")
        return replace(self, **{name: irregularity * getattr(self, name) for name in names})


@dataclass(frozen=True)
class Row:
    """One sheet's fingers, from left to right around the patch; arrays (n,), µm."""

    x: FloatArray  # tips, ascending
    y: FloatArray  # tips
    lean: FloatArray  # how far the axis moves towards +x per µm from the tip towards −y
    length: FloatArray  # from tip to the tip line of the row below
    rise: FloatArray  # height of the finger above the others


def lay_out(rng: np.random.Generator, extent: tuple[float, float], layout: Layout) -> list[Row]:
    """Rows of fingers that fill the patch of `extent` (Lx, Ly), lowest y first."""
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
        below = r - 1  # of the first row, the last one, a patch's height lower
        near = _nearest(x, columns[below], width)
        drop = tips[r] - tips[below][near] + (height if r == 0 else 0.0)
        length = np.clip(drop, 0.5 * step, 1.7 * step)
        aside = _around(columns[below][near] - x, width)
        aside[np.abs(aside) > 0.6 * layout.pitch] = 0.0  # the column ends here
        rows.append(Row(x, tips[r], aside / length, length, rises[r]))
    return rows


def _columns(
    rng: np.random.Generator, extent: tuple[float, float], n_rows: int, layout: Layout
) -> list[FloatArray]:
    """Tips' x per row: even columns and extra ones that last for some rows, then swayed."""
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


def _along_rows(
    field: FloatArray, extent: tuple[float, float], rows: list[FloatArray]
) -> list[FloatArray]:
    """Values of a periodic field at the tips of every row, before rows are bent."""
    sizes = [x.size for x in rows]
    y = np.repeat(np.arange(len(rows)) * (extent[1] / len(rows)), sizes)
    values = sample_field(field, extent, np.concatenate(rows), y)
    return np.split(values, np.cumsum(sizes)[:-1])


def _relaxed(rows: list[FloatArray], r: int, width: float, pitch: float) -> FloatArray:
    """A row's tips, moved towards even gaps and towards the tips above and below."""
    x = rows[r]
    right = np.append(x[1:], x[0] + width)
    left = np.append(x[-1] - width, x[:-1])
    tight = np.minimum(right - x, x - left) < 0.75 * pitch
    move = np.where(tight, 0.6, 0.25) * ((left + right) / 2 - x)
    for other in (rows[r - 1], rows[(r + 1) % len(rows)]):
        aside = _around(other[_nearest(x, other, width)] - x, width)
        move += np.where(np.abs(aside) < 0.6 * pitch, 0.25 * aside, 0.0)
    return np.sort(x + move)


def _thinned(x: FloatArray, width: float, least: float) -> FloatArray:
    """A row's tips without those that stand closer than `least` to the one on the left."""
    close = np.diff(x, prepend=x[-1] - width) < least
    close &= ~np.roll(close, 1)  # of three that are close, the one in the middle goes
    return x[~close] if close.any() and not close.all() else x


def _nearest(x: FloatArray, others: FloatArray, width: float) -> npt.NDArray[np.intp]:
    """Index of the nearest of `others` (ascending) to each x, around the patch."""
    around = np.concatenate([others[-1:] - width, others, others[:1] + width])
    place = np.searchsorted((around[1:] + around[:-1]) / 2, x)
    return (place - 1) % others.size


def _around(difference: FloatArray, width: float) -> FloatArray:
    """The shortest way from one x to another around the patch."""
    return difference - width * np.round(difference / width)
