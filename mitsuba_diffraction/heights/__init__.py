"""Heights: a patch of surface, from a file or a formula (NumPy; no optics).

Contents
--------
HeightField  heights in µm on a grid that tiles the plane (in `field`)
Source       where heights come from: file, recipe, several files, array; `load` (in `source`)
read         `LoadOptions`; choice of reader, units and treatments
formats      readers, by kind of file
recipes      TOML files that name the source of heights and the settings of their table
preprocess   treatments of heights: crop, fill, level, clip
gratings     height fields computed from formulas
validity     warnings where a patch leaves the model, is damaged, or lacks resolution
scatter      scatter of a rough mirror: power spectrum, total integrated scatter, ABg model
spectra      spectrum of heights, and powers of their orders
coherence    coherence width that a patch allows
lengths      checks of lengths, counts and other numbers that users write
"""

from __future__ import annotations

from .field import HeightField
from .read import LoadOptions
from .source import Source, load, treated
from .spectra import dominant_periods, order_powers
from .validity import (
    GENTLE_SLOPE,
    STEEP_SLOPE,
    jumping_lines,
    stands_in_full,
    units_warning,
    validity,
)

__all__ = [
    "GENTLE_SLOPE", "STEEP_SLOPE", "HeightField", "LoadOptions", "Source",
    "coherence", "dominant_periods", "field", "jumping_lines", "lengths", "order_powers",
    "preprocess", "read", "recipes", "scatter", "source", "spectra", "stands_in_full",
    "units_warning", "validity",
]  # fmt: skip

# Attached here: their modules import the class, so the class cannot import them.
HeightField.load = staticmethod(load)
HeightField.treated = treated
HeightField.validity = validity
