"""Tables with fewer digits, so that they compress (`tables.loss` tells what that costs)."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ...tables.colour.table import ColourTable
from ...tables.energy.powers import power_series
from ...tables.table import DiffractionTable
from ..glsl.textures import shortened


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
        order_0=order_0[:, None],
        scale=scale,
        expansion=expansion,
    )


def rounded_table(table: DiffractionTable, bits: int) -> DiffractionTable:
    """A table of powers with fewer digits."""
    return dataclasses.replace(table, coefficients=rounded(table.coefficients, bits))


def rounded_colours(table: ColourTable, bits: int) -> ColourTable:
    """A colour table with fewer digits, each of which the shader can read."""
    fewer = shortened(rounded(table.coefficients, bits)).astype(np.float16)
    return dataclasses.replace(table, coefficients=fewer, order_0=shortened(table.order_0))
