"""What costs less and changes nothing that is tested: coarse energy, short vectors.

Conservation of energy at few wavelengths and directions is for what does not ask how good it is: it
is seconds of work for each table, material and film, and a fraction of that here.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

from mitsuba_diffraction.tables.energy.settings import EnergySettings, use_energy_settings

#: Energy conserved for who does not ask how well.
COARSE = EnergySettings(
    polar=24,
    azimuthal=24,
    wavelengths=3,
    side_polar=40,
    side_wavelengths=3,
    few_parts=1,
    fringe_step=0.8,
    fringes=12,
    rings=16,
    steps=36,
    sweeps=6,
    passes=2,
)


def coarse_energy() -> EnergySettings:
    """Conserve energy coarsely in this process from now on; return the settings before."""
    return use_energy_settings(COARSE)


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
