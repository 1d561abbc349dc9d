"""Relative change of a surface's colours by the second order of small slope (NumPy, float64).

A dielectric of index 1.5 is lit from 60° at eight azimuths. For each wavelength the change is
Σ |ΔP| / Σ P over all orders but order 0 that leave within 85° of the normal, with P the power of an
order to first order and ΔP what the second order adds. Where patches have many orders, those in a
third of a cell of `slope_ratios` share a direction. The sums run over azimuths and wavelengths.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import blend, boundary
from .blend import RoughnessTable, ScaleRoughness
from .fresnel import normal_reflectance
from .geometry import wavenumber
from .second_order import factor, interpolated
from .slope_ratios import CellSums, SlopeRatios

#: Change from which `second_order="auto"` applies the second order: a difference that is seen.
AUTO_FROM = 0.05

_INDEX = 1.5
_MODEL = boundary.MODELS["small_slope"]
_THETA, _GRAZING = np.radians(60.0), np.radians(85.0)
# Eight azimuths; the offset keeps symmetric gratings from repeating one of them
_AZIMUTHS = 2.0 * np.pi * (np.arange(8) + 0.25) / 8
# Wavelengths as shares of a table's range: 454, 548 and 642 nm of the visible
_SHARES = (0.2, 0.4, 0.6)

Real = NDArray[np.float64]


def applies(second_order: str | bool, ratios: SlopeRatios) -> bool:
    """Whether a setting "auto", True or False applies the second order to a surface."""
    return ratios.change >= AUTO_FROM if second_order == "auto" else bool(second_order)


def colour_change(
    sums: CellSums,
    ratios: SlopeRatios,
    roughness: RoughnessTable | ScaleRoughness,
    wavelength_range: tuple[float, float],
) -> float:
    """Return Σ |ΔP| / Σ P; 0 for a surface without diffracted light.

    wavelength_range : shortest and longest wavelength of the table, nm.
    """
    q = np.stack(np.meshgrid(*sums.grid.fine_frequencies), axis=-1).reshape(-1, 2)
    shortest = wavelength_range[0]
    wavelengths = shortest + (wavelength_range[1] - shortest) * np.array(_SHARES)
    changed = total = 0.0
    for wave in wavenumber(wavelengths):
        for azimuth in _AZIMUTHS:
            wi = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) * np.sin(_THETA)
            wi[2] = np.cos(_THETA)
            tangential = q / wave - wi[:2]
            squares = np.sum(tangential**2, axis=1)
            leaves = squares < np.sin(_GRAZING) ** 2
            normal = np.sqrt(1.0 - squares[leaves])
            wo = np.concatenate([tangential[leaves], normal[:, None]], axis=1)
            kappa = wave * (wi[2] + normal)
            heights = boundary.Heights(kappa, roughness.at(np.hypot(*q[leaves].T)))
            pair = boundary.geometry(tuple(wi), tuple(wo.T))
            jones = _MODEL.jones(pair, _INDEX, heights)
            s = blend.small_slope_weight(*heights, normal_reflectance(_INDEX))
            # Power of an order: 4 cosθi cosθo N |a|² / w², over cosθi
            power = boundary.power(jones) / (normal * (wi[2] + normal) ** 2)
            power *= _powers(sums, leaves, kappa)
            c = interpolated(_INDEX, wi, wo)
            change = factor(c, ratios.at(q[leaves], kappa), s) - 1.0
            changed += float(np.sum(power * np.abs(change)))
            total += float(np.sum(power))
    return changed / total if total > 0.0 else 0.0


def _powers(sums: CellSums, cells: NDArray[np.bool_], kappa: Real) -> Real:
    """Σ|a|² of these of the finer cells at κ, (n,); |a|²/κ² is interpolated linearly."""
    nodes = sums.grid.summed
    depth = np.clip(np.interp(kappa, nodes, np.arange(len(nodes))), 0.0, len(nodes) - 1.001)
    lower = depth.astype(int)
    per_square = (sums.fine_power / nodes[:, None, None] ** 2).reshape(len(nodes), -1)
    columns = np.flatnonzero(cells)
    low, high = per_square[lower, columns], per_square[lower + 1, columns]
    return np.asarray((low + (depth - lower) * (high - low)) * kappa**2, np.float64)
