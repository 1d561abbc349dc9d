"""Coarse conservation of energy, for tests that do not ask how good it is.

Conservation of energy at few wavelengths and directions is for what does not ask how good it is: it
is seconds of work for each table, material and film, and a fraction of that here.
"""

from __future__ import annotations

from mitsuba_diffraction.tables.energy.settings import EnergySettings, use_energy_settings

#: Energy conserved for who does not ask how well.
COARSE = EnergySettings(
    polar=16,
    azimuthal=16,
    wavelengths=3,
    side_polar=24,
    side_wavelengths=2,
    parts=(1, 1),
    side_parts=(1, 1),
    fringes=12,
    rings=16,
    steps=36,
    sweeps=6,
    passes=2,
)


def coarse_energy() -> EnergySettings:
    """Conserve energy coarsely in this process from now on; return the settings before."""
    return use_energy_settings(COARSE)
