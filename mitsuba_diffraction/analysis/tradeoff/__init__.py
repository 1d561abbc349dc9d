"""Accuracy against speed and memory, setting by setting; `mitsuba-diffraction tradeoff` prints it.

Contents
--------
Setting               one table to try
settings              what `mitsuba-diffraction tradeoff` tries
measure               error, colours, time and memory of each setting
Measured              what that gives
lit_pairs             directions where a patch sends light
measure_wavelengths   steps of sums over the spectrum, and how many wavelengths a ray needs
measure_depths        where Taylor's series breaks down, and the others do not
Budget, recommended   the cheapest setting within a budget
"""

from __future__ import annotations

from .accuracy import lit_pairs, measure_depths, measure_wavelengths
from .measuring import Measured, Setting, measure, settings
from .report import Budget, recommended

__all__ = [
    "Budget", "Measured", "Setting", "lit_pairs", "measure", "measure_depths",
    "measure_wavelengths", "recommended", "settings",
]  # fmt: skip
