"""Reports of a plan as nested plain data: look-ups in each table, and memory that limits save."""

from __future__ import annotations

from typing import Any

from ...tables.table import DiffractionTable
from .lookups import lobes_in_a_pixel, quantiles, wavelengths_needed
from .plan import PlannedTable


def describe(planned: PlannedTable) -> dict[str, Any]:
    """Report the look-ups in a table, the limits that suffice, and the memory that they save."""
    recorded, lookups = planned.recorded, planned.recorded.lookups
    table = recorded.table
    result: dict[str, Any] = {
        "surfaces": ", ".join(recorded.surfaces),
        "heights": str(table.source.get("name", "")),
    }
    whole = _figures(table)
    if lookups is None:
        return result | {"asked for": "nothing: no path meets it; it stays whole", "whole": whole}
    lobes = lobes_in_a_pixel(recorded.lobe_turn, table.sigma)
    light = lookups.light
    result["asked for"] = {
        "share of the surfaces' light that is diffracted": float(light.sum()),
        "frequency (rad/µm)": _shares(lookups.frequency, light, "light can probe", table.q_limit),
        "frequency along x (rad/µm)": _shares(lookups.along[0], light),
        "frequency along y (rad/µm)": _shares(lookups.along[1], light),
        "kappa (rad/µm)": _shares(lookups.kappa, light, "the table has", table.expansion.kappa_max),
        "wavelengths of 99.9 %": wavelengths_needed(lookups),
        "lobes of the window in a pixel": lobes,
        "coherence": _coherence(table.coherence, lobes),
    }
    if planned.settings is None:
        return result | {
            "needs": "all of it: a smaller table would save too little",
            "whole": whole,
        }
    return result | {
        "needs": {
            "frequency (rad/µm), along x and y": list(planned.table.frequency_limit),
            "height_scale_max": planned.table.height_scale_max,
            "kappa (rad/µm)": planned.table.expansion.kappa_max,
            "share of the light outside, which is missing": planned.outside,
        },
        "whole": whole,
        "planned": _figures(planned.table),
        "times less memory": table.nbytes / planned.table.nbytes,
    }


def _figures(table: DiffractionTable) -> dict[str, Any]:
    """Size of a table."""
    return {
        "memory_mb": table.nbytes / 1e6,
        "terms": f"{table.expansion.intervals} x {table.expansion.terms}",
        "precision": str(table.coefficients.dtype),
        "taps": list(table.grid.taps),
    }


def _shares(values: Any, light: Any, name: str = "", limit: float = 0.0) -> dict[str, float]:
    """Values below which there are some shares of the light, and the largest that could be."""
    below = [0.5, 0.99, 0.999]
    result = {
        f"{100 * share:g} % of the light below": value
        for share, value in zip(below, quantiles(values, light, below), strict=True)
    }
    return result | ({name: limit} if name else {})


def _coherence(coherence: str, lobes: float) -> str:
    if not lobes >= 0.0:
        return f"{coherence}; the camera does not see the surface itself"
    if coherence == "patch" and lobes > 16.0:
        return "patch; a pixel averages so many lobes that ensemble would show the same, for less"
    if coherence == "ensemble" and lobes < 1.0:
        return "ensemble; a pixel is narrower than a lobe, patch would show its speckle"
    return f"{coherence}, as it is"
