"""Conservation of energy at few wavelengths and directions, for what does not ask how good it is.

It is seconds of work for each table, material and film, and a fraction of that here.
"""

from __future__ import annotations

from collections.abc import Callable

from mitsuba_diffraction.tables.energy import conservation, sides, sums, transport
from mitsuba_diffraction.tables.energy.grid import DirectionGrid
from mitsuba_diffraction.tables.store import energy as kept


def coarse_energy(set_value: Callable[[object, str, object], object] = setattr) -> None:
    """From now on, or for as long as a monkeypatch's `setattr` lasts."""
    set_value(conservation, "FINE_WAVELENGTHS", 3)
    set_value(sides, "SHEET", DirectionGrid(24, 24))
    set_value(sides, "DENSE", DirectionGrid(24, 24))
    set_value(sides, "WAVELENGTHS", (2, 3))
    set_value(sums, "SWEEPS", 8)
    set_value(transport, "RINGS", 16)
    set_value(transport, "STEPS", 36)
    # others have what the cache keeps in full
    for name in ("_SETTINGS", "_SIDES"):
        set_value(kept, name, ("coarse", *getattr(kept, name)))
