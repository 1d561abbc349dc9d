"""Kirchhoff, small slope and their blend beside each other, against the rigorous solutions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from .cases import PROFILES, Grating
from .compare import Comparison, compare, gratings_of, table_of
from .markdown import percent, table

#: Depth over period of the gratings that are averaged, from above the first to the second.
BANDS = ((0.0, 0.03), (0.03, 0.08), (0.08, 0.13), (0.13, 0.4))
ANGLES = (0.0, 30.0, 60.0)
MATERIALS = ("keratin", "aluminium")


def of_colours(comparison: Comparison) -> float:
    """Deviation without order 0."""
    return comparison.deviation(colours=True)


def of_te(comparison: Comparison) -> float:
    """Of TE light alone: the electric field along the grooves."""
    return comparison.deviation(colours=True, light="te")


def of_tm(comparison: Comparison) -> float:
    """Of TM light alone."""
    return comparison.deviation(colours=True, light="tm")


def banded(
    comparison: Comparison,
    angles: Sequence[float] = ANGLES,
    measure: Callable[[Comparison], float] = of_colours,
) -> Iterator[tuple[str, tuple[float, float], list[float]]]:
    """Profile, band, and the mean over its gratings of a measure at each angle."""
    for profile in PROFILES:
        for low, high in BANDS:
            gratings = within(comparison, profile, (low, high))
            if gratings:
                values = table_of(comparison, gratings, angles, measure)
                yield profile, (low, high), [float(x) for x in np.nanmean(values, axis=0)]


def within(comparison: Comparison, profile: str, band: tuple[float, float]) -> list[Grating]:
    """The gratings of a profile whose depth/period lies in a band."""
    low, high = band
    return [
        grating
        for grating in gratings_of(comparison, profile)
        # ratios are of decimal numbers: 0.2/2.5 is 0.08
        if low < round(grating.depth / grating.period, 6) <= high
    ]


def groups(comparisons: dict[tuple[str, str], Comparison]) -> str:
    """The table by profile and depth/period, from a comparison for each (material, model)."""
    return table(
        ["grating", "depth/period", *(f"{theta:g}°" for theta in ANGLES)],
        [
            [label, band, *(" / ".join(percent(values[n]) for values in same) for n in range(3))]
            for label, band, same in _rows(comparisons, _ORDER, of_colours)
        ],
    )


def polarised_groups(comparisons: dict[tuple[str, str], Comparison]) -> str:
    """The same for each polarisation alone."""
    both = ("kirchhoff", "small_slope")
    parts = [list(_rows(comparisons, both, measure)) for measure in (of_te, of_tm)]
    return table(
        ["grating", "depth/period", "TE 0°", "TE 30°", "TE 60°", "TM 0°", "TM 30°", "TM 60°"],
        [
            [
                *te[:2],
                *(
                    " / ".join(percent(v[n]) for v in light[2])
                    for light in (te, tm)
                    for n in range(3)
                ),
            ]
            for te, tm in zip(*parts, strict=True)
        ],
    )


def section(comparisons: dict[tuple[str, str], Comparison]) -> str:
    """What the default model is a blend of, and why."""
    return f"""## Kirchhoff, small slope, and the blend

`model="kirchhoff"` puts Fresnel's coefficients at the half vector for the boundary conditions. The
first-order small-slope approximation puts Rice's for them, which are right for gentle slopes at any
angle, but not where a surface is rough against the wavelength and yet gentle: that is Kirchhoff's
ground. `model="small_slope"`, the default, is a blend of both amplitudes, weighted by the roughness
at the scales that make an order (`mitsuba_diffraction/optics/blend.py`), on dielectrics times the
second order ([below](#what-the-second-order-brings)). Deviation of colours, mean over the
gratings of that depth/period: Kirchhoff / small slope alone / the default. On gentle gratings the
blend is the second, on deep ones the first, and in between it lies near the better.

{groups(comparisons)}

Unpolarised light hides a part: errors of the two polarisations have opposite signs, on metals most
of all, and cancel. Each alone, TE having the electric field along the grooves: Kirchhoff / the
default, whose second order multiplies both alike.

{polarised_groups(comparisons)}"""


def _rows(
    comparisons: dict[tuple[str, str], Comparison],
    order: Sequence[str],
    measure: Callable[[Comparison], float],
) -> Iterator[tuple[str, str, list[list[float]]]]:
    """Grating, band, and for each model of `order` the values at `ANGLES`."""
    for material in MATERIALS:
        parts = [list(banded(comparisons[material, model], ANGLES, measure)) for model in order]
        for same in zip(*parts, strict=True):
            profile, (low, high), _ = same[0]
            yield f"{material}, {profile}", f"{low:g} to {high:g}", [part[2] for part in same]


def compare_all(kirchhoff: dict[str, Comparison]) -> dict[tuple[str, str], Comparison]:
    """Every model for the solutions that Kirchhoff's comparisons have, by (material, model)."""
    found = {(material, "kirchhoff"): kirchhoff[material] for material in MATERIALS}
    for material in MATERIALS:
        # of metals it is the default
        more = ("first_order",) if material == "keratin" else ()
        for model in (*_ORDER[1:], *more):
            found[material, model] = compare(material, kirchhoff[material].solutions, model)
    return found


#: As the table has them.
_ORDER = ("kirchhoff", "small_slope_alone", "small_slope")
