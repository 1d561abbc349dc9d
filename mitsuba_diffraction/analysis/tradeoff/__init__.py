"""Accuracy against speed and memory of table settings; `mitsuba-diffraction tradeoff` prints it.

Contents
--------
TradeoffSetting       settings of one table
settings              settings that `mitsuba-diffraction tradeoff` measures
measure               error, colours, time and memory of each setting
MeasuredSetting       result of one setting
lit_pairs             pairs of directions between which a patch sends light
measure_wavelengths   error of sums over the spectrum, and noise by wavelengths per ray
measure_depths        error of each series over depth: where Taylor's diverges
Budget, recommended   best setting within a budget
"""

from __future__ import annotations

from .accuracy import lit_pairs, measure_depths, measure_wavelengths
from .measuring import MeasuredSetting, TradeoffSetting, measure, settings
from .report import Budget, recommended

__all__ = [
    "Budget", "MeasuredSetting", "TradeoffSetting", "accuracy", "lit_pairs", "measure",
    "measure_depths", "measure_wavelengths", "recommended", "report", "settings",
]  # fmt: skip
