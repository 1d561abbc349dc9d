"""Powers of the orders as series in κ, also of tables that store amplitudes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..optics.geometry import wavenumber
from .expansion import Expansion, series_sum
from .table import DiffractionTable

#: Values of κ that powers are taken at from k to 2k: of a period of theirs, and at least.
_PER_PERIOD, _FEWEST_STEPS = 16, 16


def series_kind(table: DiffractionTable) -> str:
    """How all orders but order 0 fade as κ → 0, by the kind of series that does the same.

    A power fades as κ²; in a coherent sum an amplitude beats with order 0's, and fades as κ.
    """
    return "amplitude" if table.grid.coherent else "power"


def power_expansion(table: DiffractionTable) -> Expansion:
    """A series of the power for a table of amplitudes: the power oscillates twice as fast."""
    amplitude = table.expansion
    intervals = max(1, math.ceil(amplitude.kappa_max * amplitude.half_range / 4.0))
    return Expansion(
        "chebyshev", series_kind(table), 12, intervals, amplitude.kappa_max, amplitude.half_range
    )


def fitted(expansion: Expansion, values_at: Callable[[float], NDArray[Any]]) -> NDArray[Any]:
    """Series (intervals, …, terms) of a function of κ, in the precision of its values (…)."""
    series = []
    for interval in range(expansion.intervals):
        values = np.stack([values_at(float(k)) for k in expansion.nodes(interval)], axis=-1)
        series.append(values @ expansion.fit(interval).astype(values.dtype))
    return np.stack(series)


def order_0_power(table: DiffractionTable, kappa: ArrayLike) -> NDArray[np.float64]:
    """|a_0(κ)|², the shape of κ."""
    return np.maximum(table.expansion.power_of(table.order_0_at(kappa)), 0.0)


def parts_at(table: DiffractionTable, kappa: float) -> NDArray[np.float32]:
    """Return powers, or parts of amplitudes, of all orders but order 0, (ny, nx, components).

    kappa : rad/µm.
    """
    weights = (table.expansion.weights(kappa) / table.scale).astype(np.float32)
    coefficients = table.coefficients[int(table.expansion.interval(kappa))]
    return series_sum(coefficients.astype(np.float32), weights)


def powers_at(table: DiffractionTable, kappa: float) -> NDArray[np.float32]:
    """Return |a_j(κ)|² of all orders but order 0, (ny, nx); kappa : rad/µm.

    Sharpened powers of a scan may be negative.
    """
    return table.expansion.power_of(parts_at(table, kappa))


def scattered_share(
    table: DiffractionTable, wavelength: float, band: tuple[float, float] = (0.0, np.inf)
) -> float:
    """Return the share of light along the normal that a perfect mirror of these heights scatters.

    Σ |a_j(κ_j)|² 4 cosθ/(1 + cosθ)² over the orders that propagate but order 0, κ_j = k (1 + cosθ):
    the albedo of `energy.transport`, whose lobes are points here. At most 1 of small slopes.

    wavelength : nm.
    band : shortest and longest spatial wavelength of the orders that count, µm.
    """
    k, (last_x, last_y) = float(wavenumber(wavelength)), table.grid.last
    x, y = np.arange(-last_x, last_x + 1), np.arange(-last_y, last_y + 1)[:, None]
    q = np.hypot(x * table.spacing[0], y * table.spacing[1])
    cosine = np.sqrt(np.maximum(1.0 - (q / k) ** 2, 0.0))
    # orders on the edge of the band are in it, and order 0 never
    turns = q / (2.0 * np.pi)
    cosine[(q == 0.0) | (turns * band[1] < 0.999) | (turns * band[0] > 1.001)] = 0.0
    steps = max(_FEWEST_STEPS, math.ceil(_PER_PERIOD * k * table.expansion.half_range / math.pi))
    share = 0.0
    for n, w in enumerate(np.linspace(1.0, 2.0, steps + 1)):
        # over w², |a_j|² is nearly linear between two κ
        here = np.maximum(1.0 - np.abs(cosine * steps - n), 0.0)
        share += float((here * cosine * powers_at(table, k * w)).sum()) * 4.0 / w**2
    return share


def as_powers(table: DiffractionTable) -> DiffractionTable:
    """The table whose bins are powers |a_j(κ)|² of an incoherent table, whatever it stores."""
    if table.expansion.kind == "power":
        return table
    new = power_expansion(table)
    coefficients = fitted(new, lambda kappa: powers_at(table, kappa))
    order_0 = fitted(
        new, lambda kappa: order_0_power(table, kappa) - new.order_0_offset(new.interval(kappa))
    )
    return replace(
        table, coefficients=coefficients[:, :, :, None], order_0=order_0[:, None], scale=1.0,
        expansion=new,
    )  # fmt: skip
