"""The BSDF straight from the heights: float64, slow, without series, tables or interpolation.

Every pair of directions has its own phase screen exp(iκh), made from all heights. All faster code
is measured against this (NumPy only).

Contents
--------
model         the default model in one file: the equations, numbered as in docs/theory.md
bsdf          `brdf` and `mueller`: the model with any window, material, coat and film
coat          wrapper of the model
fresnel, through  float64 judges of the formulas of the same names in `optics`
boundary      Jones and Mueller matrices, and the axes that they are about
mirror        the correction of order 0 at the horizon
transmission  `btdf`: light that goes through a dielectric
grating       `orders_brdf`: a grating from the efficiencies of its orders
screens       orders of phase screens: of a patch, and of a scan, which fade towards their edges
integral      `window_power`, `screen_power`: ⟨|P|²⟩ alone, which knows no material
arguments     checks of the arguments
"""

from __future__ import annotations

from ..optics.boundary import MODELS
from ..settings import COHERENCES
from .bsdf import brdf, mueller
from .grating import orders_brdf
from .integral import screen_power, window_power
from .screens import Sigmas
from .transmission import btdf

__all__ = [
    "COHERENCES", "MODELS", "Sigmas", "arguments", "boundary", "brdf", "btdf", "coat",
    "fresnel", "model", "mueller", "orders_brdf", "screen_power", "through", "window_power",
]  # fmt: skip
