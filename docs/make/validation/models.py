"""Deviations of Kirchhoff, small slope and their blend from rigorous solutions of gratings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from .cases import PROFILES, Grating
from .compare import Comparison, compare, gratings_of, table_of

#: Depth over period of the gratings that are averaged, from above the first to the second.
BANDS = ((0.0, 0.03), (0.03, 0.08), (0.08, 0.13), (0.13, 0.4))
ANGLES = (0.0, 30.0, 60.0)
MATERIALS = ("keratin", "aluminium")


def of_colours(comparison: Comparison) -> float:
    """Deviation of unpolarised colours."""
    return comparison.deviation(colours=True)


def of_te(comparison: Comparison) -> float:
    """Deviation of colours in TE light: the electric field along the grooves."""
    return comparison.deviation(colours=True, light="te")


def of_tm(comparison: Comparison) -> float:
    """Deviation of colours in TM light."""
    return comparison.deviation(colours=True, light="tm")


def banded(
    comparison: Comparison,
    angles: Sequence[float] = ANGLES,
    measure: Callable[[Comparison], float] = of_colours,
) -> Iterator[tuple[str, tuple[float, float], list[float]]]:
    """Mean of a measure over the gratings of each profile and band, at each angle."""
    for profile in PROFILES:
        for low, high in BANDS:
            gratings = within(comparison, profile, (low, high))
            if gratings:
                values = table_of(comparison, gratings, angles, measure)
                yield profile, (low, high), [float(x) for x in np.nanmean(values, axis=0)]


def within(comparison: Comparison, profile: str, band: tuple[float, float]) -> list[Grating]:
    """Gratings of a profile whose depth/period lies in a band."""
    low, high = band
    return [
        grating
        for grating in gratings_of(comparison, profile)
        # ratios are of decimal numbers: 0.2/2.5 is 0.08
        if low < round(grating.depth / grating.period, 6) <= high
    ]


def compare_all(kirchhoff: dict[str, Comparison]) -> dict[tuple[str, str], Comparison]:
    """Compare every model with the solutions of Kirchhoff's comparisons, by (material, model)."""
    by_model = {(material, "kirchhoff"): kirchhoff[material] for material in MATERIALS}
    for material in MATERIALS:
        for model in ("small_slope_alone", "small_slope"):
            by_model[material, model] = compare(material, kirchhoff[material].solutions, model)
    return by_model
