"""Precomputed series of diffraction orders, which the renderer looks up (NumPy only).

Contents
--------
DiffractionTable   a table: `build`, `load`, `save`, `brdf` (in `table`)
build              from heights to a table of a given tolerance
expansion          series in κ: which functions, with which weights
window             the coherence window, cut to a few taps
lookup             the NumPy twin of the renderer's look-up
exr                tables as EXR files
document           all but the coefficients as plain data, checked when read
layout             where a table's numbers lie: for NumPy, the plugin and the shaders
powers             powers of the orders as series in κ, whatever the table stores
directional        functions of direction on a grid, and of wavelength
energy             the directional albedo, and the scales that conserve energy
sampling           densities to draw directions from
order_mixture      orders for integrals: strong ones, and a density of all others
colour             the sum over daylight's spectrum
fields             checks of single values that are read from files
TableSource        the table of any source of heights, built once; `providing` (in `source`)
store              the cache, of whatever can be packed into a record
"""

from __future__ import annotations

from .build.build import build_table
from .build.spectrum import GLOSSY_RADIUS
from .exr import load_table, save_table, write_channels
from .lookup import brdf, window_sum
from .source import TableRequest, TableSource, providing
from .table import DiffractionTable

__all__ = [
    "GLOSSY_RADIUS", "DiffractionTable", "TableRequest", "TableSource", "directional",
    "expansion", "fields", "layout", "lookup", "powers", "providing", "sampling", "source",
    "store", "table", "window", "write_channels",
]  # fmt: skip

# Modules that build on the class; it shall not import them
DiffractionTable.build = staticmethod(build_table)
DiffractionTable.load = staticmethod(load_table)
DiffractionTable.save = save_table
DiffractionTable.window_sum = window_sum
DiffractionTable.brdf = brdf
