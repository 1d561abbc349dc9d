"""Kirchhoff, small slope and their blend beside each other, against the rigorous solutions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .cases import PROFILES
from .compare import Comparison, compare, gratings_of, table_of
from .markdown import percent, table

#: Depth over period of the gratings that are averaged, from above the first to the second.
BANDS = ((0.0, 0.03), (0.03, 0.08), (0.08, 0.13))
ANGLES = (0.0, 30.0, 60.0)
MATERIALS = ("keratin", "aluminium")


def of_colours(comparison: Comparison) -> float:
    """Deviation without order 0."""
    return comparison.deviation(colours=True)


def banded(
    comparison: Comparison, angles: Sequence[float] = ANGLES
) -> Iterator[tuple[str, tuple[float, float], list[float]]]:
    """Profile, band, and the mean over its gratings of the deviation of colours at each angle."""
    for profile in PROFILES:
        for low, high in BANDS:
            gratings = [
                grating
                for grating in gratings_of(comparison, profile)
                # ratios are of decimal numbers: 0.2/2.5 is 0.08
                if low < round(grating.depth / grating.period, 6) <= high
            ]
            if gratings:
                values = table_of(comparison, gratings, angles, of_colours)
                yield profile, (low, high), [float(x) for x in np.nanmean(values, axis=0)]


def section(comparisons: dict[tuple[str, str], Comparison]) -> str:
    """The table of docs/validation.md, from a comparison for each (material, model)."""
    rows = []
    for material in MATERIALS:
        parts = [list(banded(comparisons[material, model])) for model in _ORDER]
        for same in zip(*parts, strict=True):
            profile, (low, high), _ = same[0]
            cells = [
                " / ".join(percent(values[n]) for _, _, values in same) for n in range(len(ANGLES))
            ]
            rows.append([f"{material}, {profile}", f"{low:g} to {high:g}", *cells])
    header = ["grating", "depth/period", *(f"{theta:g}°" for theta in ANGLES)]
    return f"""## Kirchhoff, small slope, and the blend

`model="kirchhoff"` puts Fresnel's reflectance at the half vector for the boundary conditions. The
first-order small-slope approximation puts Rice's coefficients for them, which are right for gentle
slopes at any angle, but not where a surface is rough against the wavelength and yet gentle: that is
Kirchhoff's ground. `model="small_slope"` is a blend of both amplitudes, weighted by the roughness
at the scales that make an order (`mitsuba_diffraction/optics/blend.py`). Deviation of colours, mean
over the gratings of that depth/period: Kirchhoff / small slope alone / the blend.

{table(header, rows)}"""


def compare_all(kirchhoff: dict[str, Comparison]) -> dict[tuple[str, str], Comparison]:
    """Every model for the solutions that Kirchhoff's comparisons have, by (material, model)."""
    found = {(material, "kirchhoff"): kirchhoff[material] for material in MATERIALS}
    for material in MATERIALS:
        for model in _ORDER[1:]:
            found[material, model] = compare(material, kirchhoff[material].solutions, model)
    return found


#: As the table has them.
_ORDER = ("kirchhoff", "small_slope_alone", "small_slope")
