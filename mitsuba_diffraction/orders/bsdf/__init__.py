"""The BSDF `diffraction_orders`: gratings whose orders were solved (Dr.Jit).

Contents
--------
diffraction_orders  `DiffractionOrders`: reflection, and both sides of a sheet or a block's face
lobes               a table's look-up inside a kernel, light of all orders in a variant's channels,
                    and directions drawn by it
daylight_lobes      the same in RGB variants, summed over daylight
polarised_lobes     Mueller matrices in polarised variants
"""

from __future__ import annotations

__all__ = ["diffraction_orders"]
