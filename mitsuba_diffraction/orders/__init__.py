"""Gratings with solved orders: solvers, one table, its look-up, the BSDF, lists.

Contents
--------
OrderTable    efficiencies, or Mueller matrices, of all orders, over cells or listed light
read_orders   a table from efficiencies of another program, or of a bench
list_orders   a table's efficiencies as the lines of a CSV
cells, rows   coordinates in which efficiencies are smooth; even grids, under a coat
lookup        look-up in NumPy and in kernels, of cells, blocks and listed light
bsdf          the BSDF in Dr.Jit
solve         solvers: from a profile to a table
"""

from __future__ import annotations

from .efficiency import efficiency, groove_efficiency, mueller, polarised_efficiency
from .file import load_orders, save_orders
from .table import Band, Cells, Listed, OrderTable

__all__ = ["Band", "Cells", "Listed", "OrderTable"]

# Modules that build on the class; it shall not import them
OrderTable.efficiency = efficiency
OrderTable.polarised_efficiency = polarised_efficiency
OrderTable.groove_efficiency = groove_efficiency
OrderTable.mueller = mueller
OrderTable.load = staticmethod(load_orders)
OrderTable.save = save_orders
