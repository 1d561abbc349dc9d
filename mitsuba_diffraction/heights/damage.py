"""Damage of scans that shows in their heights: aborted and repeated lines, a bow, dust."""

from __future__ import annotations

import numpy as np

from .field import LARGE, FloatArray, HeightField
from .preprocess import MAD_TO_SIGMA, level_plane, level_quadratic

#: Second difference, over the RMS one of the scan, below which a line is straight.
STRAIGHT = 1e-6
#: Fewest lines that are reported: a flat groove may have two.
FEWEST = 3
#: Share of the variance that a paraboloid has to explain to be a bow; structure has less.
BOW = 0.5
#: Points so many robust standard deviations from the median are dust or spikes, unless more than
#: this share of all are, or half of a row or column, a groove for instance.
FAR, LARGEST_DUST, LARGEST_IN_LINE = 6.0, 0.01, 0.5
#: Dust is reported if heights clipped to `FAR` have less than this share of the RMS height.
WITHOUT_DUST = 0.9
#: Standard deviations to clip to: of normally distributed heights 1 in 2 million is further off.
CLIP = 5
#: A bow below it, µm, bends the wave by less than a quarter of a wavelength.
LEAST_BOW = 0.045


def damage(field: HeightField) -> list[str]:
    """Return a line for each damage of a scan, with what to do; empty for other patches."""
    if not field.cut_out or field.heights.size > LARGE or min(field.shape) < 8 or field.range == 0:
        return []
    return [line for line in (_aborted(field), _repeated(field), _bow(field), _dust(field)) if line]


def _aborted(field: HeightField) -> str:
    """Return a line on rows without structure at an end of the scan."""
    straight = _is_straight(field.heights)
    ends = {"first": _run(straight), "last": _run(straight[::-1])}
    where, count = max(ends.items(), key=lambda end: end[1])
    rows = len(straight)
    if count < FEWEST or count == rows:
        return ""
    height = field.pixel_size[1]
    kept, low = (rows - count) * height, count * height if where == "first" else 0.0
    return (
        f"{field.name}: use crop={field.extent[0]:.4g},{kept:.4g},0,{low:.4g}: the {where} {count} "
        f"rows of {rows} (from the bottom) have no structure, as of an aborted scan, and reflect "
        "like a mirror"
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


def _dust(field: HeightField) -> str:
    """Return a line on few points that make much of the relief."""
    level = level_plane(field).heights
    median = float(np.median(level))
    far = FAR * MAD_TO_SIGMA * float(np.median(np.abs(level - median)))
    outside = np.abs(level - median) > far
    share = float(outside.mean())
    lines = max(float(outside.mean(axis=axis).max()) for axis in (0, 1))
    if not 0.0 < share <= LARGEST_DUST or lines > LARGEST_IN_LINE or far == 0.0:
        return ""
    clipped = np.clip(level, median - far, median + far)
    rms, without = float(level.std()), float(clipped.std())
    if without > WITHOUT_DUST * rms:
        return ""
    return (
        f"{field.name}: use clip={CLIP} if they are dust or spikes: {int(outside.sum())} points "
        f"({share:.2g} of all) are up to {np.abs(level - median).max():.3g} µm from the others, "
        f"and the RMS height is {rms:.3g} µm with them, {without:.3g} µm without"
    )


def _is_straight(lines: FloatArray) -> np.ndarray:
    """Whether each line is straight: levelling may have tilted it."""
    bends = np.diff(lines, n=2, axis=1)
    size = np.sqrt(np.mean(np.square(bends)))
    return np.abs(bends).max(axis=1) <= STRAIGHT * max(float(size), 1e-300)


def _run(flags: np.ndarray) -> int:
    """Count how many flags are set at the beginning."""
    return len(flags) if flags.all() else int(flags.argmin())
