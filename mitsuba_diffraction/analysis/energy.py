"""Albedo of a table's surface for three materials, before and after energy conservation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..orders.solve.grating_index import material_of
from ..tables import DiffractionTable
from ..tables.energy.conservation import Energy, SurfaceEnergy
from ..tables.energy.conserved import Reflector, Transmitter

#: Polar angles (degrees), wavelengths (nm), and number of azimuths of the albedos.
ANGLES, WAVELENGTHS, AZIMUTHS = (0.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0), (450.0, 550.0, 650.0), 24
#: Polar angles whose losses are listed, degrees.
SHOWN = (0.0, 45.0, 60.0, 75.0)
#: Polar angles of R + T, degrees.
PASSED = (0.0, 30.0, 45.0, 60.0, 75.0)
#: Removed share of the albedo from which on a warning is issued.
WARN_REMOVED = 0.05


def energy_summary(table: DiffractionTable) -> dict[str, Any]:
    """Return the albedo of each material before and after conservation, and the removed share.

    The albedos are sums over the orders at 24 azimuths of seven angles up to 80° at 450, 550 and
    650 nm, not at the nodes for which the scale is computed.
    """
    materials = {
        "dielectric 1.5": Reflector("small_slope", lambda lam: np.full(len(lam), 1.5 + 0j)),
        "aluminium": Reflector("small_slope", material_of("Al", WAVELENGTHS[::2]).index),
        "none (R = 1)": Reflector("kirchhoff", lambda lam: None),
    }
    return {name: _material_summary(table, material) for name, material in materials.items()}


def _material_summary(table: DiffractionTable, material: Reflector) -> dict[str, Any]:
    """Return the summary of one material."""
    raw, conserved = np.moveaxis(_sums(table, material, ANGLES)[:, :, 0], 1, 0)
    removed = 1.0 - conserved / raw
    gains = raw > 1.0
    result: dict[str, Any] = {
        "model": material.model,
        "albedo": _range(raw),
        "albedo, conserved": _range(conserved),
        "taken, largest": round(float(removed.max()), 4),
        "taken at": {
            f"{angle:g}°": round(float(removed[:, ANGLES.index(angle)].max()), 4) for angle in SHOWN
        },
        "conserved over raw where that is at most 1": _range((conserved / raw)[~gains]),
        "within 1 % there": round(float((np.abs(removed[~gains]) <= 0.0101).mean()), 3),
    }
    if gains.any():
        result["conserved where raw is above 1"] = _range(conserved[gains])
        inside = (conserved[gains] >= 0.97) & (conserved[gains] <= 1.001)
        result["between 0.97 and 1.001 there"] = round(float(inside.mean()), 3)
    return result


def sides_summary(table: DiffractionTable) -> dict[str, Any]:
    """Return R + T of a dielectric of index 1.5 and of a thin sheet of it, raw and conserved.

    Values are the least and the largest of 24 azimuths at 450, 550 and 650 nm, for light from above
    and from below.
    """
    result: dict[str, Any] = {}
    for name, thin in (("dielectric 1.5, both sides", False), ("sheet 1.5", True)):
        sums = _sums(table, Transmitter(1.5, "small_slope", thin), PASSED)
        result[name] = {
            f"{kind}, from {side}": {
                f"{angle:g}°": _range(sums[:, n, m, i]) for i, angle in enumerate(PASSED)
            }
            for m, side in enumerate(("above", "below"))
            for n, kind in enumerate(("R + T", "R + T, conserved"))
        }
    return result


def _sums(
    table: DiffractionTable, material: Reflector | Transmitter, angles: Sequence[float]
) -> NDArray[np.float64]:
    """Return R or R + T, (wavelengths, raw or conserved, sides, angles, azimuths).

    Azimuths are off the grid's nodes and the axes of symmetry; angles in degrees.
    """
    conservation = Energy(table, material, table.wavelength_range).at(1.0)
    phi = (np.arange(AZIMUTHS, dtype=np.float64) + 0.3) * (2.0 * np.pi / AZIMUTHS)
    surface, theta = SurfaceEnergy(table, material), np.radians(angles)
    pairs = [surface.albedos(conservation, theta, phi, wavelength) for wavelength in WAVELENGTHS]
    return np.array(pairs, float)


def _range(values: NDArray[np.floating]) -> list[float]:
    """Return the smallest and the largest value."""
    return [round(float(values.min()), 3), round(float(values.max()), 3)]


def energy_warnings(summary: dict[str, Any]) -> list[str]:
    """Return a warning for each material that loses much light, or loses it without a gain."""
    much = [
        f"with {name}, the relief would send out more light than it receives: the excess, up to "
        f"{100 * energy['taken, largest']:.0f} %, is removed (up to 80° from the normal; "
        "energy_conserving=false keeps it), and colours are least certain there"
        for name, energy in summary.items()
        if energy["taken, largest"] > WARN_REMOVED
    ]
    lost = {
        name: 1.0 - energy["conserved over raw where that is at most 1"][0]
        for name, energy in summary.items()
    }
    return much + [
        f"with {name}, directions that gain nothing lose up to {100 * share:.0f} %, too: strong "
        "orders become propagating between the scale's directions, as on gratings (docs/energy.md)"
        for name, share in lost.items()
        if share > WARN_REMOVED
    ]
