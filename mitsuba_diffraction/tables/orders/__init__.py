"""Solved orders: efficiencies of a periodic profile's orders, over directions and wavelengths.

Contents
--------
OrderTable  efficiencies at nodes: checks, look-up, `save`, `load` (in `table`)
Band        efficiencies of the directions with the same number of propagating orders
crossed     `CrossedTable`: efficiencies of a crossed grating
cells       coordinates in which efficiencies are smooth, and Chebyshev nodes of them
lookup      interpolation in NumPy
blocks      light on both sides of a block's face, whose channels differ in number
polarised   Mueller matrices of orders, and their axes
grids       even grids that the BSDF reads, under a coat where the table has one
daylight    the sum of an order's lobe over daylight, for RGB variants
file        tables as NetCDF files
"""

from __future__ import annotations

from .crossed import CrossedTable
from .file import load_any_orders, load_crossed, load_orders, save_crossed, save_orders
from .lookup import efficiency, groove_efficiency, mueller, polarised_efficiency
from .table import Band, OrderTable

__all__ = ["Band", "CrossedTable", "OrderTable", "load_any_orders"]

# Modules that build on the class; it shall not import them
OrderTable.efficiency = efficiency
OrderTable.polarised_efficiency = polarised_efficiency
OrderTable.groove_efficiency = groove_efficiency
OrderTable.mueller = mueller
OrderTable.load = staticmethod(load_orders)
CrossedTable.load = staticmethod(load_crossed)
CrossedTable.save = save_crossed
OrderTable.save = save_orders
