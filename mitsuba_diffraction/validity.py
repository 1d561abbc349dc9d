"""Where a patch leaves the model, or its own resolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .heightfield import HeightField

#: RMS slopes up to which the model's orders are within 5 % and 20 % of rigorous solutions, for
#: sinusoids of a perfect conductor in light up to 45° from the normal: docs/validation.md has the
#: rule, `validation.limits` the computation, of which these are rounded down.
GENTLE_SLOPE = 0.1
STEEP_SLOPE = 0.35

#: Heights whose whole range is below a tenth of an atom's radius are usually metres taken for µm.
SMALLEST_RANGE = 1e-5


def validity(field: HeightField, wavelength_range: Sequence[float]) -> list[str]:
    """One line per cause; see `HeightField.validity`.

    Parameters
    ----------
    wavelength_range : shortest and longest wavelength, nm.
    """
    shortest = min(wavelength_range) / 1000  # µm
    lines = []
    if field.rms_slope > STEEP_SLOPE:
        lines.append(
            f"{field.name}: RMS slope {field.rms_slope:.2g} is above {STEEP_SLOPE:g}: scalar "
            "Kirchhoff diffraction is off by more than 20 % on slopes this steep, and by up to "
            "all of the light on steeper ones"
        )
    elif field.rms_slope > GENTLE_SLOPE:
        lines.append(
            f"{field.name}: RMS slope {field.rms_slope:.2g} is above {GENTLE_SLOPE:g}: beside "
            "rigorous solutions, expect scalar Kirchhoff diffraction to be off by 5 to 20 % in "
            "light up to 45° from the normal, and by more beyond"
        )
    coarse = max(field.pixel_size)
    if coarse > shortest / 4:
        # k |(u, v)| reaches 2k at grazing angles on both sides, the pixels π/dx
        reach = shortest / (2 * coarse)
        lines.append(
            f"{field.name}: pixels of {coarse:.3g} µm are coarser than a quarter of the "
            f"shortest wavelength, {shortest / 4:.3g} µm: nothing is known of directions "
            f"with |sinθi + sinθo| above {reach:.2g} at {shortest * 1000:g} nm"
        )
    if 0 < field.range < SMALLEST_RANGE:
        lines.append(
            f"{field.name}: heights span only {field.range:.2g} µm, less than an atom: "
            "are they in metres? Multiply them by 1e6"
        )
    return lines
