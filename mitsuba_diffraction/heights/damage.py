"""Damage of scans that shows in their heights: aborted and repeated lines, a scanner's bow."""

from __future__ import annotations

import numpy as np

from .field import LARGE, FloatArray, HeightField
from .preprocess import level_plane, level_quadratic

#: Second difference, over the RMS one of the scan, below which a line is straight.
STRAIGHT = 1e-6
#: Fewest lines that are reported: a flat groove may have two.
FEWEST = 3
#: Share of the variance that a paraboloid has to explain to be a bow; structure has less.
BOW = 0.5
#: A bow below it, µm, bends the wave by less than a quarter of a wavelength.
LEAST_BOW = 0.045


def damage(field: HeightField) -> list[str]:
    """Return a line for each damage of a scan, with what to do; empty for other patches."""
    if not field.cut_out or field.heights.size > LARGE or min(field.shape) < 8 or field.range == 0:
        return []
    return [line for line in (_aborted(field), _repeated(field), _bow(field)) if line]


def _aborted(field: HeightField) -> str:
    """Return a line on rows without structure at an end of the scan."""
    straight = _is_straight(field.heights)
    ends = {"first": _run(straight), "last": _run(straight[::-1])}
    where, count = max(ends.items(), key=lambda end: end[1])
    rows = len(straight)
    if count < FEWEST or count == rows:
        return ""
    kept = (rows - count) * field.pixel_size[1]
    return (
        f"{field.name}: cut the scan to the other {rows - count} rows, {kept:.4g} µm: its {where} "
        f"{count} rows of {rows} (from the bottom) have no structure, as of an aborted scan, and "
        "reflect like a mirror"
    )


def _repeated(field: HeightField) -> str:
    """Return a line on rows that repeat the one before."""
    repeats = _is_straight(np.diff(field.heights, axis=0)) & ~_is_straight(field.heights)[1:]
    count = int(repeats.sum())
    if not FEWEST <= count < 0.5 * len(repeats):
        return ""
    return (
        f"{field.name}: scan again, or cut the scan: {count} of {field.shape[0]} rows repeat the "
        "row before, as where a scanner was stuck"
    )


def _bow(field: HeightField) -> str:
    """Return a line on a paraboloid that makes most of the relief."""
    if any("paraboloid" in line for line in field.history):
        return ""
    level = level_plane(field)
    even = level_quadratic(field)
    bow = level.heights - even.heights
    if bow.var() < BOW * level.heights.var() or np.ptp(bow) < LEAST_BOW:
        return ""
    return (
        f"{field.name}: use level=quadratic: the patch is bent by {np.ptp(bow):.3g} µm, as a "
        "scanner's arc bends it, more than its relief"
    )


def _is_straight(lines: FloatArray) -> np.ndarray:
    """Whether each line is straight: levelling may have tilted it."""
    bends = np.diff(lines, n=2, axis=1)
    size = np.sqrt(np.mean(np.square(bends)))
    return np.abs(bends).max(axis=1) <= STRAIGHT * max(float(size), 1e-300)


def _run(flags: np.ndarray) -> int:
    """Count how many flags are set at the beginning."""
    return len(flags) if flags.all() else int(flags.argmin())
