"""The thesis' sweeps: one parameter of a BRDF map after the other, compared.

Contents
--------
SWEEPS     their names
sweep      the maps of one of them
Step       one value of the parameter: its map, time and distance
Sweep      all of them
"""

from __future__ import annotations

from .run import SWEEPS, Step, Sweep, sweep

__all__ = ["SWEEPS", "Step", "Sweep", "sweep"]
