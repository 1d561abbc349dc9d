"""Surveys: many scans, each with its table, map, statistics, gratings and colours, in one table.

Contents
--------
treatments   how files are treated, by patterns of their names
measure      one scan: what a worker does
iridescence  the colours of a map, and how much they change with direction
run          all scans, only those that are new; CSV and contact sheet: `run_survey`
"""

from __future__ import annotations

from .iridescence import colours_of, iridescence
from .run import run_survey
from .treatments import Treatment, treatments_of

__all__ = ["Treatment", "colours_of", "iridescence", "run_survey", "treatments_of"]
