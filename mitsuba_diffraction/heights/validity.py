"""Warnings of a patch that leaves the model's range, does not resolve its surface, or is damaged.

Damage that shows in heights: aborted and repeated lines, a bow, dust.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Real
from ..errors import counted
from .coherence import COLOURLESS
from .field import LARGE, HeightField, blocks
from .preprocess import MAD_TO_SIGMA, arc_of, hann, level_plane, plane_of, plane_rise
from .spectra import seen_slope

#: RMS slopes up to which the default model's colours are within 5 % and 20 % of rigorous solutions,
#: for sinusoids of keratin and aluminium in light up to 60° from the normal. docs/validation.md has
#: the rule and the table; docs/make/validation/limits.py computes 0.139 and 0.356, rounded down
#: here.
GENTLE_SLOPE = 0.13
STEEP_SLOPE = 0.35

#: Range of heights, µm, a tenth of an atom's radius: smaller ones are usually metres taken for µm.
SMALLEST_RANGE = 1e-5

#: RMS slope of 84°, steeper than any surface that is a height field: nanometres taken for µm.
IMPOSSIBLE_SLOPE = 10.0
#: Words of the warnings that no command shortens.
UNRELIABLE, AS_FACET = "do not rely on its colours", "taken for a facet"
_IN_METRES, _IN_NM = "less than an atom", "in nm? Then divide"
#: Pixel size in µm beyond which the patch resolves at most a tenth of the directions at 380 nm.
#: Scans have pixels of some nm to a few hundred.
COARSEST_PIXEL = 2.0

#: A plane that rises by λ/8 tilts the reflected wave by λ/4, Rayleigh's limit for a negligible
#: aberration: a flat patch then sends 19 % of its mirror light, 1 − sinc²(1/4), into other orders.
QUARTER_WAVE = 8.0
#: A plane that rises by less than this part of the RMS height occurs by chance in rough patches.
CHANCE = 0.5
#: A plane occurs by chance in few pixels, too: in white noise of N it rises by √(12/N) of the RMS
#: height, one standard deviation. A tilt rises by so many.
SURE = 4.0
#: A plane that rises by at most the largest mean step between neighbouring lines, over this, is
#: that of a facet or of a groove: one period of a blazed or lamellar grating rises by 1.5 steps.
STEP = 0.6
#: Levelling a ramp stored in 8-bit grey leaves 0.4 % of its RMS height. A patch of which less than
#: this is left is a smooth scan that is tilted, or one facet, a whole period of a blazed grating:
#: its seams are the grating's steps. Facets are steeper than a sample is mounted: 2.9°.
FACET, FACET_SLOPE = 0.01, 0.05
#: Ratio of the steps between medians of neighbouring rows to those of columns, from which on scan
#: lines jump. Isotropic surfaces stay within 1.5; ridges along x have correlated rows.
JUMPS = 3.0

#: Fewest rows and columns of which damage is told from structure.
FEWEST_LINES = 8
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


def validity(field: HeightField, wavelength_range: Sequence[float] = (360.0, 830.0)) -> list[str]:
    """Return warnings where a patch leaves the model or its own resolution; empty if it does not.

    wavelength_range : shortest and longest wavelength, nm.

    Returns
    -------
    One line per cause.
    """
    shortest = min(wavelength_range) / 1000  # µm
    lines = []
    slope = field.rms_slope
    if GENTLE_SLOPE < slope <= IMPOSSIBLE_SLOPE:
        slope = seen_slope(field, shortest)
    question = units_warning(field)
    seen = " of the waves that light resolves" if slope < 0.95 * field.rms_slope else ""
    if field.rms_slope > IMPOSSIBLE_SLOPE:
        lines.append(
            f"{field.name}: {question}; no surface has an RMS slope of {field.rms_slope:.2g}"
        )
        question = ""  # once
    elif slope > STEEP_SLOPE:
        lines.append(
            f"{field.name}: {UNRELIABLE}: RMS slope {slope:.2g}{seen} is above "
            f"{STEEP_SLOPE:g}, where they differ from rigorous solutions by more than 20 %, on "
            "steeper surfaces completely"
        )
    elif slope > GENTLE_SLOPE:
        lines.append(
            f"{field.name}: expect colours to differ from rigorous solutions by 5 to 20 % in light "
            f"60° from the normal: RMS slope {slope:.2g}{seen} is above {GENTLE_SLOPE:g}; "
            "they differ by less nearer to the normal, by more at edges and with model='kirchhoff'"
        )
    coarse = max(field.pixel_size)
    if coarse > shortest / 4:
        # k |(u, v)| reaches 2k at grazing angles on both sides, the pixels π/dx
        reach = shortest / (2 * coarse)
        lines.append(
            f"{field.name}: {question or 'scan with finer pixels'}: pixels of "
            f"{coarse:.3g} µm are coarser than a quarter of the shortest wavelength, which is "
            f"{shortest / 4:.3g} µm, and do not resolve directions with |sinθi + sinθo| above "
            f"{reach:.2g} at {shortest * 1000:g} nm"
        )
    if 0 < field.range < SMALLEST_RANGE:
        lines.append(
            f"{field.name}: multiply the heights by 1e6 if they are in metres: they span only "
            f"{field.range:.2g} µm, {_IN_METRES}"
        )
    if field.cut_out:
        if tilted(field, shortest):
            turn = math.degrees(2 * math.atan(math.hypot(*plane_of(field))))
            lines.append(
                f"{field.name}: use level=plane: the patch is not levelled; its best plane rises "
                f"{plane_rise(field):.3g} µm across it and turns the mirror direction by "
                f"{turn:.2g}°"
            )
        elif _facet(field, level_plane(field)) and plane_rise(field) > shortest / QUARTER_WAVE:
            lines.append(
                f"{field.name}: use level=plane if it is a tilted scan: a plane that rises "
                f"{plane_rise(field):.3g} µm is nearly all of its relief, {AS_FACET} of a blazed "
                "grating and not levelled; periodic=exact says that it is one"
            )
        lines += damage(field)
    return lines


def stands_in_full(line: str) -> bool:
    """Return whether commands print a warning itself, beside the number of the others."""
    grave = UNRELIABLE, AS_FACET, _IN_METRES, _IN_NM, COLOURLESS
    return any(part in line for part in grave)


def _facet(field: HeightField, level: HeightField) -> bool:
    """Return whether a patch is one facet, by its levelled heights."""
    steep = math.hypot(*plane_of(field)) >= FACET_SLOPE
    return steep and level.rms_height < FACET * field.rms_height


def tilted(field: HeightField, shortest: float) -> bool:
    """Return whether the least-squares plane of a scan is a tilt that turns the mirror direction.

    A facet's plane is no tilt: it rises by as much as the step at the facet's end. Nor is a plane
    that waves tilt: four periods of a sine of amplitude a tilt the least-squares plane by up to
    0.48 a across the patch, and the plane weighted by a Hann window by 0.08 a.

    shortest : shortest wavelength, µm.
    """
    levelled = level_plane(field)
    if _facet(field, levelled):
        return False
    level = levelled.rms_height
    chance = max(CHANCE, SURE * math.sqrt(12.0 / field.heights.size))
    least = max(shortest / QUARTER_WAVE, chance * level)
    slopes = np.abs([plane_of(field), plane_of(field, hann(field))]).min(axis=0)
    for axis, slope, length in zip((1, 0), slopes, field.extent, strict=True):
        lines, rise = field.heights.swapaxes(0, axis), float(slope * length)
        steps = (np.abs(np.diff(part, axis=0).mean(axis=1)) for part in blocks(lines, 1))
        if rise > least and max(float(s.max(initial=0.0)) for s in steps) < STEP * rise:
            return True
    return False


def jumping_lines(field: HeightField) -> str:
    """Return advice where rows of a scan jump, as lines of an AFM do, or ""."""
    if not field.cut_out or min(field.shape) < FEWEST_LINES or _aligned(field):
        return ""
    steps = [np.diff(np.median(field.heights, axis=axis)).std() for axis in (1, 0)]
    pixels = field.pixel_size
    rows, columns = steps[0] / pixels[1], steps[1] / pixels[0]
    jumps = np.diff(np.median(field.heights, axis=1))
    # lines that jump change sign from row to row; a structure along y does not
    random = float(np.mean(jumps[1:] * jumps[:-1])) < 0.0
    if not (random and rows > JUMPS * max(columns, 1e-12)):
        return ""
    return (
        f"{field.name}: use level=lines: scan lines jump by {1e3 * steps[0]:.2g} "
        f"nm RMS from row to row, {rows / max(columns, 1e-12):.2g} times as steeply as columns; "
        "that diffracts like a grating along y"
    )


def units_warning(field: HeightField) -> str:
    """Return a warning that lengths look like nanometres read as µm, or "" if plausible.

    A unit that the file states is not doubted.
    """
    coarse, steep = max(field.pixel_size), field.rms_slope > IMPOSSIBLE_SLOPE
    pixels, heights = f"the pixel size of {coarse:.4g} µm", f"with a range of {field.range:.4g} µm"
    named = "(heights of a file: height_unit=nm; of an image: max_height)"
    asked = "heights" not in field.stated
    if steep and asked:
        return f"are the heights, {heights}, {_IN_NM} them by 1000 {named}"
    if steep:
        return f"check pixel_size and height_unit: {pixels} contradicts heights {heights}"
    if coarse <= COARSEST_PIXEL or "pixel_size" in field.stated:
        return ""
    if asked and 1000.0 * field.rms_slope > IMPOSSIBLE_SLOPE:  # on pixels a thousandth as wide
        return f"are {pixels} and the heights, {heights}, {_IN_NM} both by 1000 {named}"
    return f"is {pixels} {_IN_NM} it by 1000"


def damage(field: HeightField) -> list[str]:
    """Return a line for each damage of a scan, with what to do; empty for other patches."""
    few = min(field.shape) < FEWEST_LINES
    if not field.cut_out or field.heights.size > LARGE or few or field.range == 0:
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
    """Return a line on rows that repeat the one before, unless gaps were filled so."""
    if any("method nearest" in line for line in field.history):
        return ""
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
    level = level_plane(field).heights
    bow = arc_of(level)
    if bow.var() < BOW * level.var() or np.ptp(bow) < LEAST_BOW:
        return ""
    remedy = "level=quadratic"
    if _aligned(field):  # by the option that this one would replace
        remedy = "HeightField.treated(level='quadratic') in Python, beside level=lines"
    return (
        f"{field.name}: use {remedy}: the patch is bent by {np.ptp(bow):.3g} µm, as a "
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
        f"{field.name}: use clip={CLIP} if they are dust or spikes: "
        f"{counted(int(outside.sum()), 'point')} ({share:.2g} of all) up to "
        f"{np.abs(level - median).max():.3g} µm from the others, "
        f"and the RMS height is {rms:.3g} µm with them, {without:.3g} µm without"
    )


def _aligned(field: HeightField) -> bool:
    """Whether the lines of a scan were aligned."""
    return any("scan lines aligned" in line for line in field.history)


def _is_straight(lines: Real) -> np.ndarray:
    """Whether each line is straight: levelling may have tilted it."""
    bends = np.diff(lines, n=2, axis=1)
    size = np.sqrt(np.mean(np.square(bends)))
    return np.abs(bends).max(axis=1) <= STRAIGHT * max(float(size), 1e-300)


def _run(flags: np.ndarray) -> int:
    """Count how many flags are set at the beginning."""
    return len(flags) if flags.all() else int(flags.argmin())
