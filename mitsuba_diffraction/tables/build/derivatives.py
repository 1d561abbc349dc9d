"""Derivatives of a table's coefficients by the heights of a patch that tiles the plane (NumPy).

With the orders a_j = mean of exp(iκh) exp(iq_j·r) of N pixels, a change dh of the heights changes
the power of an order by 2 Re[a_j* mean of iκ dh exp(iκh) exp(iq_j·r)], and a loss L changes by the
adjoint of the DFT (as in gradients of phase retrieval: Fienup 1982, Applied Optics 21, 2758)

    ∂L/∂h = −(2κ/N) Im[exp(iκh) · conj Σ_j (∂L/∂|a_j|²) a_j exp(−iq_j·r)].

Chebyshev coefficients are linear in powers at the nodes of κ; so are their derivatives.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import fft

from ...arrays import Complex, Real
from ..table import DiffractionTable
from .spectrum import Crop


def missing(table: DiffractionTable) -> list[str]:
    """Return the settings that a table lacks to have derivatives: none of one patch's powers."""
    settings = {
        "coherence=ensemble": table.expansion.kind == "power",
        "basis=chebyshev": table.expansion.basis == "chebyshev",
        "periodic=exact": table.inverse_taper == 0.0,
    }
    return [setting for setting, given in settings.items() if not given]


class HeightDerivatives:
    """Linear maps between changes of heights and of a table's coefficients.

    Parameters
    ----------
    table : one that misses nothing (`missing`).
    heights : (ny, nx), µm, that the table is made of, up to a constant.
    """

    def __init__(self, table: DiffractionTable, heights: Real) -> None:
        self._table, self._heights = table, heights
        self._columns, self._rows = (
            Crop(n, last) for n, last in zip(heights.shape[::-1], table.grid.last, strict=True)
        )

    def forward(self, change: Real) -> tuple[Real, Real]:
        """Return the change of coefficients and of order 0's, for one (ny, nx) of the heights, µm.

        They have the shapes of `DiffractionTable.coefficients`, over its `scale`, and `order_0`.
        """
        table = self._table
        bins = np.zeros(table.coefficients.shape)
        order_0 = np.zeros(table.order_0.shape)
        for interval, kappa, fit, screen in self._nodes():
            changed = self._orders(1j * kappa * change * screen)
            power = 2.0 * (self._orders(screen).conj() * changed).real
            order_0[interval, 0] += power[table.grid.middle] * fit
            power[table.grid.middle] = 0.0
            bins[interval, :, :, 0] += power[..., None] * fit
        return bins, order_0

    def backward(self, bins: Real, order_0: Real) -> Real:
        """Return the derivative of a loss by heights, (ny, nx), 1/µm.

        bins, order_0 : its derivatives by coefficients, in the shapes that `forward` returns.
        """
        table = self._table
        total = np.zeros_like(self._heights)
        for interval, kappa, fit, screen in self._nodes():
            by_power = bins[interval, :, :, 0] @ fit
            by_power[table.grid.middle] = order_0[interval, 0] @ fit
            spectrum = np.zeros(screen.shape, complex)
            weighted = by_power * self._orders(screen)
            inner = np.ix_(self._rows.target, self._columns.target)
            spectrum[np.ix_(self._rows.source, self._columns.source)] = weighted[inner]
            product = screen * fft.fft2(spectrum, overwrite_x=True).conj()
            total -= 2.0 * kappa / screen.size * product.imag
        return total

    def _nodes(self) -> Iterator[tuple[int, float, Real, Complex]]:
        """Yield interval, κ, its factors on coefficients and exp(iκh) at all nodes."""
        expansion = self._table.expansion
        for interval in range(expansion.intervals):
            fits = expansion.fit(interval)
            for kappa, fit in zip(expansion.nodes(interval).tolist(), fits, strict=True):
                yield interval, kappa, fit, np.exp(1j * kappa * self._heights)

    def _orders(self, screen: Complex) -> Complex:
        """Return the orders of the table's grid, 0 beyond the Nyquist frequency of pixels."""
        orders = np.zeros(self._table.grid.shape, complex)
        inner = np.ix_(self._rows.source, self._columns.source)
        orders[np.ix_(self._rows.target, self._columns.target)] = fft.ifft2(screen)[inner]
        return orders
