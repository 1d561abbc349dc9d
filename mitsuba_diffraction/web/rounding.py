"""Tables with fewer digits, so that they compress; and what that costs."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ..colour import delta_e, linear_srgb, response
from ..tables.colour_build import VISIBLE
from ..tables.colour_table import ColourTable
from ..tables.powers import power_series
from ..tables.table import DiffractionTable

_PAIRS = 1500  # of directions; the mean of their ΔE is known to some per cent
_STEP = 2.0  # nm


def rounded(values: NDArray[np.floating], bits: int) -> NDArray[np.float16]:
    """Each row (…, n) rounded to multiples of 2^-bits of its largest number's power of two.

    A row is one series: what is added up has one absolute error. As half floats the results end in
    zeros, which compress.
    """
    exact = values.astype(np.float32)
    largest = np.abs(exact).max(axis=-1, keepdims=True)
    step = np.exp2(np.ceil(np.log2(np.maximum(largest, 2.0**-24))) - bits)
    return (np.round(exact / step) * step).astype(np.float16)


def power_table(table: DiffractionTable) -> DiffractionTable:
    """The same table storing powers, as method `spectral` reads them; not for coherent sums."""
    series, order_0, scale, expansion = power_series(table)
    return dataclasses.replace(
        table,
        coefficients=series[:, :, :, None],
        order_0=order_0[:, None].astype(np.float32),
        scale=scale,
        expansion=expansion,
    )


def rounded_table(table: DiffractionTable, bits: int) -> DiffractionTable:
    """A table of powers with fewer digits."""
    return dataclasses.replace(table, coefficients=rounded(table.coefficients, bits))


def rounded_colours(table: ColourTable, bits: int) -> ColourTable:
    """A colour table with fewer digits."""
    return dataclasses.replace(table, coefficients=rounded(table.coefficients, bits))


def colour_loss(table: ColourTable, other: ColourTable) -> NDArray[np.float64]:
    """ΔE2000 (n,) between two colour tables, over random pairs of directions."""
    u, v, z, factor = _pairs(_PAIRS)
    return _loss(table.colour(u, v, z), other.colour(u, v, z), factor)


def power_loss(table: DiffractionTable, other: DiffractionTable) -> NDArray[np.float64]:
    """ΔE2000 (n,) between two tables of powers, summed over daylight's wavelengths."""
    u, v, z, factor = _pairs(_PAIRS // 3)
    lam = np.arange(*VISIBLE, _STEP)[:, None]
    weights = linear_srgb(response(lam[:, 0])) / lam**2
    k = 2e3 * np.pi / lam
    exact, found = (t.window_sum(k * u, k * v, k * z).T @ weights for t in (table, other))
    return _loss(exact, found, factor)


def _pairs(count: int) -> tuple[NDArray[np.float64], ...]:
    """u, v, z of random pairs of directions away from the specular one, and w² to divide by."""
    rng = np.random.default_rng(2)
    radius, turn = (
        np.sqrt(rng.uniform(0, 0.95, (2, _PAIRS))),
        rng.uniform(0, 2 * np.pi, (2, _PAIRS)),
    )
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    z = np.sqrt(1.0 - radius**2)
    return x.sum(axis=0), y.sum(axis=0), z.sum(axis=0), z.sum(axis=0) ** -2 / z[0]


def _loss(
    exact: NDArray[np.float64], other: NDArray[np.float64], factor: NDArray[np.float64]
) -> NDArray[np.float64]:
    found = delta_e(exact * factor[:, None], other * factor[:, None])
    return found[np.isfinite(found)]
