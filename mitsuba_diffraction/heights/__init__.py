"""Heights: a patch of surface, from a file or a formula (NumPy; no optics).

Contents
--------
HeightField  heights in µm on a grid that tiles the plane (in `field`)
load         from any file to a `HeightField`
read         `LoadOptions`; which reader, which units, which treatment
formats      the readers, by kind of file
recipes      TOML files that say where heights come from and what is made of them
preprocess   treatments of heights: crop, fill, level, clip, make periodic
gratings     height fields that are made, not measured
validity     where a patch leaves the model or its own resolution
spectra      the spectrum of heights, and the powers of their orders
lengths      lengths, counts and other numbers as users give them
"""

from __future__ import annotations

from .field import HeightField
from .load import load, treated
from .validity import validity

__all__ = ["HeightField"]

# Modules that build on the class; it shall not import them
HeightField.load = staticmethod(load)
HeightField.treated = treated
HeightField.validity = validity
