"""Gratings with solved orders: solvers, one table, its look-up, the BSDF, lists.

Contents
--------
OrderTable     efficiencies, or Mueller matrices, of all orders (in `table`)
efficiency     its answers in NumPy
file           tables as NetCDF files
cells          coordinates in which efficiencies are smooth
rows           even grids of a table, under a coat, for the renderer and shaders
blocks         light on both sides of a block's face, whose channels differ in number
polarised      Mueller matrices of orders, and their axes
daylight       the sum of an order's lobe over daylight, for RGB variants
grid           records of a table that its look-up interpolates
lookup         look-up of cells and blocks, in NumPy and in kernels
listed_lookup  the same of listed light
response       elements of Mueller matrices over cells, or of listed light
listed         tables of listed light
table_error    the error of a table beside known efficiencies
imported       `read_orders`: of another program's efficiencies, or of a bench
lists          files of efficiencies, CSV and NetCDF, and their conventions
listing        `list_orders`: a table's efficiencies as such a file
bsdf           the BSDF `diffraction_orders` in Dr.Jit
solve          solvers: from a profile to a table
"""

from __future__ import annotations

from .efficiency import (
    efficiency,
    groove_efficiency,
    jones,
    lookup_in,
    mueller,
    polarised_efficiency,
)
from .file import load_orders, save_orders
from .response import Band, CellResponse, ListedResponse
from .table import OrderTable

__all__ = [
    "Band", "CellResponse", "ListedResponse", "OrderTable", "cells", "daylight", "file", "imported",
    "listed", "listing", "lookup", "lookup_in", "rows",
]  # fmt: skip

# Modules that build on the class; it shall not import them
OrderTable.efficiency = efficiency
OrderTable.polarised_efficiency = polarised_efficiency
OrderTable.groove_efficiency = groove_efficiency
OrderTable.mueller = mueller
OrderTable.jones = jones
OrderTable.load = staticmethod(load_orders)
OrderTable.save = save_orders
