"""Coarse conservation of energy and little light between surfaces, for tests that ask for neither.

Conservation of energy at few wavelengths and directions is for what does not ask how good it is: it
is seconds of work for each table, material and film, and a fraction of that here.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

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


def coarse_energy() -> None:
    """Conserve energy coarsely in this process from now on."""
    use_energy_settings(COARSE)


@contextlib.contextmanager
def energy_as(settings: EnergySettings) -> Iterator[None]:
    """Conserve energy by these settings in a `with` block."""
    before = use_energy_settings(settings)
    try:
        yield
    finally:
        use_energy_settings(before)


#: Points and cells of the light between surfaces, and height scales of pages, as powers of 2.
_LITTLE = {
    "mitsuba_diffraction.realtime.glsl.bounces._POINTS": 1 << 8,
    "mitsuba_diffraction.realtime.glsl.surroundings._CELLS": 1 << 16,
    "mitsuba_diffraction.realtime.web.export.OCTAVES": (0.0,),
}


def little_light(setattr_of: Callable[[str, object], None]) -> None:
    """Make what commands of the realtime room compute small, by `monkeypatch.setattr`."""
    for name, value in _LITTLE.items():
        setattr_of(name, value)
