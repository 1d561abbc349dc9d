"""Deviations of Kirchhoff, small slope and their blend from rigorous solutions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from .cases import PROFILES, Grating
from .compare import Comparison, Sides, compare, gratings_of, table_of
from .solutions import LIGHTS, Solutions

#: Depth over period of the gratings that are averaged, from above the first to the second.
BANDS = ((0.0, 0.03), (0.03, 0.08), (0.08, 0.13), (0.13, 0.4))
ANGLES = (0.0, 30.0, 60.0)
MATERIALS = ("keratin", "aluminium")
#: Models of the plugin, and all that are compared.
BOTH = ("kirchhoff", "small_slope")
COMPARED = ("kirchhoff", "small_slope_alone", "small_slope")

#: Deviation of colours: unpolarised, and with the electric field along the grooves or across.
of_colours, of_te, of_tm = (
    partial(Comparison.deviation, colours=True, light=light) for light in (None, *LIGHTS)
)


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


def by_model(solutions: Solutions, models: Sequence[str] = BOTH) -> Sides:
    """Compare models with solutions."""
    return {model: compare(solutions, model) for model in models}


def of_cells(comparison: Comparison, light: str | None = None, **values: object) -> list[float]:
    """Deviations of colours of the cases with these values, as `Case.has`."""
    parts = comparison.where(**values).each()
    return [part.deviation(colours=True, light=light) for part in parts]
