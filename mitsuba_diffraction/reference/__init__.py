"""The diffraction BRDF straight from its integral: float64, slow and obviously right (NumPy only).

No series, no table and no interpolation: for every direction pair the phase screen exp(iκh) is
formed from all heights and projected on plane waves. Everything else is measured against this.

Contents
--------
bsdf       `brdf`, `mueller`, `btdf`: the integral, times what the material makes of the light
integral   `window_power`, `screen_power`: the integral alone, which knows no material
second_order  the integral, each order times its factor of the second order of small slope
arguments  what they take, checked
"""

from __future__ import annotations

from ..settings import COHERENCES
from .arguments import MODELS
from .bsdf import brdf, btdf, mueller
from .integral import screen_power, window_power

__all__ = ["COHERENCES", "MODELS", "brdf", "btdf", "mueller", "screen_power", "window_power"]
