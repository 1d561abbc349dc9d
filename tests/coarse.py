"""Conservation of energy at few wavelengths and directions, for what does not ask how good it is.

It is seconds of work for each table, material and film, and a fraction of that here.
"""

from __future__ import annotations

from collections.abc import Callable

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.tables.energy import conservation, sides, sums, transport
from mitsuba_diffraction.tables.energy import store as kept
from mitsuba_diffraction.tables.energy.grid import DirectionGrid


def coarse_energy(set_value: Callable[[object, str, object], object] = setattr) -> None:
    """From now on, or for as long as a monkeypatch's `setattr` lasts."""
    set_value(conservation, "FINE_WAVELENGTHS", 3)
    set_value(sides, "SHEET", DirectionGrid(24, 24))
    set_value(sides, "DENSE", DirectionGrid(24, 24))
    set_value(sides, "WAVELENGTHS", (2, 3))
    set_value(sums, "SWEEPS", 8)
    set_value(transport, "RINGS", 16)
    set_value(transport, "STEPS", 36)
    # others have what tables and the cache keep in full
    set_value(conservation, "_orders", _orders)
    for name in ("_SETTINGS", "_SIDES"):
        set_value(kept, name, ("coarse", *getattr(kept, name)))


def _orders(table: DiffractionTable, height_scale: float) -> transport.Orders:
    """As `conservation` keeps them, apart from its own."""
    last = table.__dict__.setdefault("_coarse_orders", {})
    if height_scale not in last:
        last.clear()
        last[height_scale] = transport.Orders(table, height_scale)
    return last[height_scale]
