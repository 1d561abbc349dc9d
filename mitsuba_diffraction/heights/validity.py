"""Warnings of a patch that leaves the model's range or does not resolve its surface."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .field import HeightField
from .preprocess import level_plane, plane_of, plane_rise, trend_of
from .seams import Seam, edge_steps, seams_of
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
#: Words of the warning that no command shortens.
UNRELIABLE = "do not rely on its colours"
#: Pixel size in µm beyond which the patch resolves at most a tenth of the directions at 380 nm.
#: Scans have pixels of some nm to a few hundred.
COARSEST_PIXEL = 2.0

#: A plane that rises by λ/8 tilts the reflected wave by λ/4, Rayleigh's limit for a negligible
#: aberration: a flat patch then sends 19 % of its mirror light, 1 − sinc²(1/4), into other orders.
QUARTER_WAVE = 8.0
#: A plane that rises by less than this part of the RMS height occurs by chance in rough patches.
CHANCE = 0.5
#: Levelling a ramp stored in 8-bit grey leaves 0.4 % of its RMS height. A patch of which less than
#: this is left is one facet, a whole period of a blazed grating: its seams are the grating's steps.
FACET = 0.01
#: Share of the mean-square slope from which on seams are reported. For gentle heights it is the
#: seams' share of the light outside the mirror direction, weighted with the angle's squared sine.
SEAM_SHARE = 0.1
#: Share of a seam's mean-square step that may remain without the cubic trend: with more, structure
#: that the edge cuts makes most of the step, not waves longer than the patch.
TREND_SHARE = 0.5


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
    seen = " of the waves that light resolves" if slope < 0.95 * field.rms_slope else ""
    if field.rms_slope > IMPOSSIBLE_SLOPE:
        lines.append(
            f"{field.name}: {units_warning(field)}; no surface has an RMS slope of "
            f"{field.rms_slope:.2g}"
        )
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
            f"{field.name}: {units_warning(field) or 'scan with finer pixels'}: pixels of "
            f"{coarse:.3g} µm are coarser than a quarter of the shortest wavelength, which is "
            f"{shortest / 4:.3g} µm, and do not resolve directions with |sinθi + sinθo| above "
            f"{reach:.2g} at {shortest * 1000:g} nm"
        )
    if 0 < field.range < SMALLEST_RANGE:
        lines.append(
            f"{field.name}: multiply the heights by 1e6 if they are in metres: they span only "
            f"{field.range:.2g} µm, less than an atom"
        )
    if field.cut_out:
        lines += edge_lines(field, shortest)
    return lines


def edge_lines(field: HeightField, shortest: float) -> list[str]:
    """Return warnings of a patch whose opposite edges need not meet: of its tilt and its seams.

    Parameters
    ----------
    field : the patch.
    shortest : shortest wavelength, µm.

    Returns
    -------
    list of str
        At most one line on the tilt and one on the seams.
    """
    lines = []
    without_tilt, levelled = field, ""
    if tilted(field, shortest):
        slope_x, slope_y = plane_of(field)
        turn = math.degrees(2 * math.atan(math.hypot(slope_x, slope_y)))
        lines.append(
            f"{field.name}: use level=plane: the patch is not levelled; its best "
            f"plane rises {plane_rise(field):.3g} µm across it and turns the mirror direction by "
            f"{turn:.2g}°"
        )
        without_tilt, levelled = level_plane(field), " even after levelling"
    share, worst = seam_defects(without_tilt)
    if worst is not None:
        largest = worst.largest_inside
        compared = (
            f"{worst.step / largest:.2g} times the largest step between neighbours inside"
            if largest > 0
            else "with no step between neighbours inside"
        )
        lines.append(
            f"{field.name}: use periodic=trend: the patch tiles the surface, "
            f"and its seams, {share:.0%} of the mean-square slope, diffract like a grating; "
            f"opposite edges differ by {worst.step:.3g} µm RMS{levelled}, {compared}"
        )
    return lines


def seam_defects(field: HeightField) -> tuple[float, Seam | None]:
    """Return the seams' share of the mean-square slope, and the worst; None where none shows.

    Seams of structure that the edges cut are none: no treatment mends them, and smoothing them adds
    more light near the mirror direction than they do.
    """
    if _is_facet(field):
        return 0.0, None
    seams = seams_of(field)
    pairs = zip(seams, trend_of(field).steps(), edge_steps(field), strict=True)
    defects = [
        seam
        for seam, trend, step in pairs
        if seam.defect and np.mean((step - trend) ** 2) < TREND_SHARE * np.mean(step**2)
    ]
    slope = sum(seam.slope for seam in defects)
    inside = sum(seam.slope_inside for seam in seams)
    if not slope > SEAM_SHARE * (slope + inside):
        return 0.0, None
    return slope / (slope + inside), max(defects, key=lambda seam: seam.slope)


def _is_facet(field: HeightField) -> bool:
    """Return whether a patch is flat, or but for noise one facet."""
    return field.range == 0 or level_plane(field).rms_height < FACET * field.rms_height


def tilted(field: HeightField, shortest: float) -> bool:
    """Return whether the least-squares plane is a relevant tilt along one axis at least.

    A tilt raises one edge over the opposite one by the plane's rise. The plane that fits a few
    periods of a grating does not: the edges meet, or differ by a step that occurs inside, too.

    shortest : shortest wavelength, µm.
    """
    if _is_facet(field):
        return False
    level = level_plane(field)
    least = max(shortest / QUARTER_WAVE, CHANCE * level.rms_height)
    for slope, length, seam in zip(plane_of(field), field.extent, seams_of(field), strict=True):
        rise = slope * length
        if abs(rise) > least and abs(seam.rise - rise) < 0.5 * abs(seam.rise) and seam.defect:
            return True
    return False


def units_warning(field: HeightField) -> str:
    """Return a warning that lengths look like nanometres read as µm, or "" if plausible."""
    coarse = max(field.pixel_size)
    if coarse > COARSEST_PIXEL:
        return f"is the pixel size of {coarse:.4g} µm in nm? Then divide it by 1000"
    if field.rms_slope > IMPOSSIBLE_SLOPE:
        return (
            f"are the heights, with a range of {field.range:.4g} µm, in nm? Then divide them (of "
            "an image: max_height) by 1000"
        )
    return ""
