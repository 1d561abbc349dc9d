"""The thesis' look-up of a Taylor series: one image of complex numbers per term."""

from __future__ import annotations

import os
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..analysis.timing import quiet_bsdf
from ..plugin.device_table import DeviceTable, Gaussians
from ..plugin.memory import upload
from ..plugin.types import Float, Index
from ..tables import DiffractionTable


def thesis_bsdf(table: DiffractionTable | str | os.PathLike[str], **parameters: Any) -> Any:
    """Load the plugin with a coherent Taylor table that `TermImages` looks up."""
    bsdf = quiet_bsdf(table, **parameters)
    bsdf.power.device = TermImages(bsdf.table)
    return bsdf


class TermImages(DeviceTable):
    """A coherent Taylor table as the thesis stores it: an image of complex numbers per term.

    For every wavelength and every term, the 3 × 3 texels around the frequency are gathered from
    that term's image, weighted by the Gaussian window, and added up. `plugin.device_table` stores
    all terms of one bin together instead. Only `amplitude` differs.
    """

    def __init__(self, table: DiffractionTable) -> None:
        super().__init__(table)
        images = np.moveaxis(table.coefficients[0], -1, 0)  # (terms, ny, nx, re and im)
        self._images = upload(mi.Float, np.ascontiguousarray(images))

    def amplitude(
        self, first: Index, across: Gaussians, along: Gaussians, weights: list[Float]
    ) -> list[Float]:
        """See `DeviceTable.amplitude`."""
        grid = self.grid
        texels = [
            (grid.index(0, row, column), across.at(column) * along.at(row))
            for row in range(grid.taps[1])
            for column in range(grid.taps[0])
        ]
        x = weights[0]

        def add_term(n: Any, image: Any, weight: Any, total: Any) -> tuple[Any, ...]:
            """Add term n of the series: the state of the loop after it."""
            weight *= x / mi.Float(n)  # xⁿ/n!
            windowed = mi.Complex2f(0.0)
            for offset, gaussian in texels:
                windowed += gaussian * dr.gather(mi.Complex2f, self._images, image + offset)
            return n + 1, image + grid.index(1, 0, 0), weight, total + weight * windowed

        state = (mi.UInt32(1), first, mi.Float(1.0), mi.Complex2f(0.0))
        total = dr.while_loop(state, lambda n, *_: n <= self.expansion.terms, add_term)[3]
        return [total.real, total.imag]
