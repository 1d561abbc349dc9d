"""Powers of a patch's orders as textures: terms of each order, and their factors over κ."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..tables import DiffractionTable
from ..tables.expansion import Expansion
from ..tables.layout import BinRecord, cells_of, functions_at
from ..tables.powers import as_powers, order_0_power

#: Phase over a cell of κ, within which factors are interpolated linearly; the error is its square
#: over 8, 1e-4.
CELL = 0.03


class PackedPowers(NamedTuple):
    """Powers of all orders of a patch, as shaders read them.

    The power of an order at κ is the sum of its terms times the factors at κ, over `scale`; in the
    first interval it is multiplied by the square of the share of the interval at which κ lies.

    Attributes
    ----------
    orders : (intervals, rows, columns, 4 texels) terms; order 0 is zero.
    factors : (intervals, cells + 1, texels + 1, 4) factors at both ends of each cell of κ, linear
        between them, and the power of order 0 in the first channel of the last texel.
    scale, expansion : of the terms.
    """

    orders: NDArray[np.floating]
    factors: NDArray[np.float32]
    scale: float
    expansion: Expansion

    @property
    def texels(self) -> int:
        """Texels of four terms of an order."""
        return self.orders.shape[-1] // 4

    @property
    def cells(self) -> int:
        """Cells of κ in an interval."""
        return self.factors.shape[1] - 1


def pack_powers(table: DiffractionTable, cell: float = CELL) -> PackedPowers:
    """Pack the powers of an incoherent table; amplitudes are converted to powers.

    cell : phase over a cell of κ, rad.
    """
    table.require_whole("a list of powers is made of")
    powers = as_powers(table)
    series, expansion = powers.coefficients, powers.expansion
    record = BinRecord.of(1, expansion.terms, unit=4)
    orders = record.pack(series).reshape(*series.shape[:3], record.stored)
    cells = cells_of(expansion, cell)
    share = np.clip(np.arange(cells + 1) / cells, 1e-6, 1.0 - 1e-6)
    kappa = expansion.length * (np.arange(expansion.intervals)[:, None] + share)
    factors = np.zeros((*kappa.shape, record.stored + 4), np.float32)
    factors[..., : expansion.terms] = functions_at(expansion, kappa)
    factors[..., record.stored] = order_0_power(table, kappa)
    return PackedPowers(orders, factors.reshape(*kappa.shape, -1, 4), powers.scale, expansion)
