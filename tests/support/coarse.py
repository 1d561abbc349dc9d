"""What costs less and changes nothing that is tested: coarse energy, short vectors.

Conservation of energy at few wavelengths and directions is for what does not ask how good it is: it
is seconds of work for each table, material and film, and a fraction of that here.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.tables.energy import conservation, sides, sums, transport
from mitsuba_diffraction.tables.energy import store as kept
from mitsuba_diffraction.tables.energy.grid import DirectionGrid


def coarse_energy(set_value: Callable[[object, str, object], object] = setattr) -> None:
    """From now on, or for as long as a monkeypatch's `setattr` lasts."""
    set_value(conservation, "WAVELENGTHS", 3)
    set_value(sides, "SHEET", DirectionGrid(24, 24))
    set_value(sides, "DENSE", DirectionGrid(24, 24))
    set_value(sides, "FINER", DirectionGrid(24, 24))
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


def vectors_of(lanes: int) -> int:
    """LLVM's vectors hold so many lanes in this process from now on; how many they held before.

    Kernels of 16 lanes, of processors that have them, take half as long again to compile as those
    of 8. Python has no name for this function of Dr.Jit's: where it is not found, or no LLVM is,
    nothing changes.
    """
    import drjit as dr

    if not dr.has_backend(dr.JitBackend.LLVM):
        return lanes
    try:
        library = ctypes.CDLL(str(Path(dr.__file__).with_name("libdrjit-core.so")))
        width, set_target = (
            library._Z21jit_llvm_vector_widthv,
            library._Z19jit_llvm_set_targetPKcS0_j,
        )
        described = library._Z19jit_llvm_target_cpuv, library._Z24jit_llvm_target_featuresv
    except (OSError, AttributeError):
        return lanes
    for text in described:
        text.restype = ctypes.c_char_p
    before = int(width())
    set_target(*(ctypes.c_char_p(text()) for text in described), ctypes.c_uint32(lanes))
    return before
