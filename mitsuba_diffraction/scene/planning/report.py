"""Reports of a plan as nested plain data: light of each table, and memory that limits save."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Real
from ...optics.colour import delta_e, linear_srgb, response
from ...optics.geometry import wavenumber
from ...tables import DiffractionTable
from .light import BINS, WAVELENGTHS
from .plan import PlannedTable, quantiles


def describe(planned: PlannedTable) -> dict[str, Any]:
    """Report the light of a table, the limits that suffice, and the memory that they save."""
    light, table = planned.light, planned.light.table
    result: dict[str, Any] = {
        "surfaces": ", ".join(light.surfaces),
        "heights": str(table.source.get("name", "")),
    }
    whole = _figures(table)
    if not light.share:
        return result | {"asked for": "nothing: no path meets it; it stays whole", "whole": whole}
    # 1/(kσ) wide are the lobes, and where ωi turns by δ, so does ωo: (u, v) moves by up to 2δ
    lobes = float((2.0 * light.lobe_turn * wavenumber(550.0) * table.sigma) ** 2)
    (x, y), by = light.edges, light.frequency
    kappa_max = table.expansion.kappa_max
    kappa = kappa_max / BINS * np.arange(1.0, BINS + 1.0)
    result["asked for"] = {
        "share of the surfaces' light that is diffracted": light.share,
        "frequency (rad/µm)": _shares(np.hypot(x, y), by, "light can probe", table.q_limit),
        "frequency along x (rad/µm)": _shares(x, by.sum(axis=0)),
        "frequency along y (rad/µm)": _shares(y, by.sum(axis=1)),
        "kappa (rad/µm)": _shares(kappa, light.kappa, "the table has", kappa_max),
        "wavelengths of 99.9 %": wavelengths_needed(light.wavelength),
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
            "share of the light outside, at most": planned.outside,
        },
        "whole": whole,
        "planned": _figures(planned.table),
        "times less memory": table.nbytes / planned.table.nbytes,
    }


def wavelengths_needed(light: Real, share: float = 1e-3) -> dict[str, Any]:
    """Return the band that all but a share of the diffracted light lies in, half on either side.

    light : (470,) between `WAVELENGTHS`, in X + Y + Z.

    Returns range_nm, and lost_colour: ΔE2000 between the mean colours of all light and of the band
    alone.
    """
    low, high = (
        quantiles(ends, light, [part])[0]
        for ends, part in ((WAVELENGTHS[:-1], 0.5 * share), (WAVELENGTHS[1:], 1.0 - 0.5 * share))
    )
    middle = 0.5 * (WAVELENGTHS[1:] + WAVELENGTHS[:-1])
    seen = response(middle)
    xyz = light[:, None] * seen / seen.sum(axis=1, keepdims=True)
    inside = (middle >= low) & (middle <= high)
    colours = [linear_srgb(xyz[part].sum(axis=0)) for part in (slice(None), inside)]
    largest = max(float(np.abs(colours[0]).max()), 1e-30)
    lost = delta_e(colours[0][None] / largest, colours[1][None] / largest, exposure=1.0)
    return {"range_nm": [low, high], "lost_colour": float(lost[0])}


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
