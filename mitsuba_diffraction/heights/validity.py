"""Where a patch leaves the model, or its own resolution."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .field import HeightField
from .preprocess import level_plane, plane_of, plane_rise, seams_of

#: RMS slopes up to which the default model's colours are within 5 % and 20 % of rigorous solutions,
#: for sinusoids of keratin and aluminium in light up to 60° from the normal: docs/validation.md has
#: the rule and the table, docs/make/validation/limits.py the computation (0.139 and 0.356), of
#: which these are rounded down.
GENTLE_SLOPE = 0.13
STEEP_SLOPE = 0.35

#: Heights whose whole range is below a tenth of an atom's radius are usually metres taken for µm.
SMALLEST_RANGE = 1e-5

#: Steeper than any surface that is a height field, 84°: nanometres taken for µm.
IMPOSSIBLE_SLOPE = 10.0
#: Pixels in µm beyond which at most a tenth of the directions is known at 380 nm; scans have some
#: nm to a few hundred.
COARSEST_PIXEL = 2.0

#: A plane that rises by λ/8 tilts the reflected wave by λ/4, Rayleigh's limit of what can be left
#: alone: a flat patch then sends 19 % of its mirror light, 1 − sinc²(1/4), into other orders.
QUARTER_WAVE = 8.0
#: Below this share of the RMS height a best plane is what any rough patch has by chance.
CHANCE = 0.5
#: What levelling leaves of a ramp in 8-bit grey is 0.4 % of its RMS height: a patch of which no
#: more is left is one facet, a whole period of a blazed grating, and its seams are the steps.
FACET = 0.01
#: Share of the mean-square slope from which on seams are said. For gentle heights it is their share
#: of the light outside the mirror direction, weighted with the square of the angle's sine.
SEAM_SHARE = 0.1

# No window narrower than this has directions to speak of, µm: a wavelength and a half.
_NARROWEST = 1.0

# A patch this much smaller than the coherence width is worth a warning.
_SMALLER = 0.9

#: Texts that tables keep in a cache are those of this version: raise it with any of them.
TEXTS_VERSION = 2


def validity(field: HeightField, wavelength_range: Sequence[float] = (360.0, 830.0)) -> list[str]:
    """Say where a patch leaves the model or its own resolution; an empty list is fine.

    Parameters
    ----------
    wavelength_range : shortest and longest wavelength, nm.

    Returns
    -------
    One line per cause.
    """
    shortest = min(wavelength_range) / 1000  # µm
    lines = []
    if field.rms_slope > IMPOSSIBLE_SLOPE:
        lines.append(
            f"{field.name}: RMS slope {field.rms_slope:.2g} is no surface's: {units_warning(field)}"
        )
    elif field.rms_slope > STEEP_SLOPE:
        lines.append(
            f"{field.name}: RMS slope {field.rms_slope:.2g} is above {STEEP_SLOPE:g}: beside "
            "rigorous solutions, the colours are off by more than 20 % on slopes this steep, and "
            "by up to all of the light on steeper ones"
        )
    elif field.rms_slope > GENTLE_SLOPE:
        lines.append(
            f"{field.name}: RMS slope {field.rms_slope:.2g} is above {GENTLE_SLOPE:g}: beside "
            "rigorous solutions, expect the colours to be off by 5 to 20 % in light 60° from the "
            "normal, by less in steeper light, by more at edges and with model='kirchhoff'"
        )
    coarse = max(field.pixel_size)
    if coarse > shortest / 4:
        # k |(u, v)| reaches 2k at grazing angles on both sides, the pixels π/dx
        reach = shortest / (2 * coarse)
        lines.append(
            f"{field.name}: pixels of {coarse:.3g} µm are coarser than a quarter of the "
            f"shortest wavelength, which is {shortest / 4:.3g} µm: nothing is known of directions "
            f"with |sinθi + sinθo| above {reach:.2g} at {shortest * 1000:g} nm"
            + (f"; {units_warning(field)}" if coarse > COARSEST_PIXEL else "")
        )
    if 0 < field.range < SMALLEST_RANGE:
        lines.append(
            f"{field.name}: heights span only {field.range:.2g} µm, less than an atom: "
            "are they in metres? Multiply them by 1e6"
        )
    if field.cut_out:
        lines += edge_lines(field, shortest)
    return lines


def edge_lines(field: HeightField, shortest: float) -> list[str]:
    """What to say of a patch whose opposite edges need not meet: tilt, then the seams that stay.

    Parameters
    ----------
    field : the patch.
    shortest : shortest wavelength, µm.

    Returns
    -------
    list of str
        At most one line on the tilt and one on the seams.
    """
    if field.range == 0:
        return []
    level = level_plane(field)
    if level.rms_height < FACET * field.rms_height:
        return []
    lines = []
    judged, once = field, ""
    if _tilted(field, level, shortest):
        slope_x, slope_y = plane_of(field)
        turn = math.degrees(2 * math.atan(math.hypot(slope_x, slope_y)))
        lines.append(
            f"{field.name}: not levelled: the best plane rises {plane_rise(field):.3g} µm across "
            f"the patch and turns the mirror direction by {turn:.2g}°; try level=plane "
            "(--level plane)"
        )
        judged, once = level, " even once levelled"
    seams = seams_of(judged)
    foreign = [seam for seam in seams if seam.foreign]
    slope = sum(seam.slope for seam in foreign)
    inside = sum(seam.inside for seam in seams)
    if slope > SEAM_SHARE * (slope + inside):
        worst = max(foreign, key=lambda seam: seam.slope)
        share = slope / (slope + inside)
        times = f"{worst.step / worst.largest:.2g} times" if worst.largest > 0 else "unlike"
        lines.append(
            f"{field.name}: opposite edges differ by {worst.step:.3g} µm RMS{once}, {times} the "
            f"largest step between neighbours inside: the patch tiles the surface, and its seams, "
            f"{share:.0%} of the mean-square slope, diffract as a grating of their own; try "
            "periodic=smooth (--periodic smooth)"
        )
    return lines


def _tilted(field: HeightField, level: HeightField, shortest: float) -> bool:
    """Whether the best plane is a tilt that matters, along one axis at least.

    A tilt raises one edge over the opposite one by what it rises. The plane that fits a few
    periods of a grating does not: their edges meet, or differ by a step as inside.
    """
    least = max(shortest / QUARTER_WAVE, CHANCE * level.rms_height)
    for slope, length, seam in zip(plane_of(field), field.extent, seams_of(field), strict=True):
        rise = slope * length
        if abs(rise) > least and abs(seam.rise - rise) < 0.5 * abs(seam.rise) and seam.foreign:
            return True
    return False


def units_warning(field: HeightField) -> str:
    """Whether lengths are nanometres taken for µm, as a question; "" if nothing speaks for it."""
    coarse = max(field.pixel_size)
    if coarse > COARSEST_PIXEL:
        return f"is the pixel size of {coarse:.4g} µm in nm? Then divide it by 1000"
    if field.rms_slope > IMPOSSIBLE_SLOPE:
        return (
            f"are the heights, with a range of {field.range:.4g} µm, in nm? Then divide them (of "
            "an image: max_height) by 1000"
        )
    return ""


def window_warning(field: HeightField, coherence_width: float) -> str:
    """What to say of a patch that is smaller than the coherence window; "" of others."""
    width, height = field.extent
    if min(width, height) >= _SMALLER * coherence_width:
        return ""
    fitting = _two_digits(min(width, height))
    advice = f"take coherence_width={fitting:g} (--coherence-width {fitting:g}) or a larger patch"
    if fitting < _NARROWEST:
        advice = "take a larger patch, or check its pixel size, which is in µm"
    return (
        f"{field.name}: the patch of {width:.4g} × {height:.4g} µm is smaller than the coherence "
        f"width of {coherence_width:g} µm: it is tiled, and its repetition shows as a grating of "
        f"its own; if it is none, {advice}"
    )


def _two_digits(length: float) -> float:
    """The largest number of two digits that is not above a length."""
    unit = 10.0 ** (math.floor(math.log10(length)) - 1)
    return float(f"{math.floor(length / unit * (1 + 1e-9)) * unit:.2g}")
