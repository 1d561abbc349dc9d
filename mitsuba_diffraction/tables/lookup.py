"""Reading a table at any spatial frequency and κ: the NumPy twin of the renderer's look-up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from ..optics.geometry import diffraction_coordinates, kirchhoff_factor, wavenumber
from ..optics.mirror import horizon_correction
from .table import DiffractionTable
from .window import taps_at

#: A bin's weight by its distance in bins, element by element.
Kernel = Callable[[NDArray[np.float64]], NDArray[np.float64]]

_CHUNK = 1 << 14  # look-ups at a time: (chunk × terms) floats stay in cache


def window_sum(
    table: DiffractionTable,
    qx: ArrayLike,
    qy: ArrayLike,
    kappa: ArrayLike,
    place: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Σ_j |a_j|² (σ_j/σ)² exp(−σ_j²|q − q_j|²), σ_j = σ but of order 0: the sum of eq. 3.

    For `patch` |Σ_j a_j exp(−σ²|q − q_j|²/2) exp(−i q_j·x₀)|².

    Either is ⟨|P|²⟩ / 4π²σ⁴, dimensionless, at most about `table.order_0_ratio`.

    Raises a DiffractionError for a place in a table that holds no amplitudes of `patch`.

    Parameters
    ----------
    qx, qy : spatial frequencies k·u and k·v, rad/µm, any common shape.
    kappa : k·w·height_scale, rad/µm.
    place : (..., 2), centre x₀ of the window in µm from the patch's first pixel, for a table of
        `patch`, whose own is the patch's centre.

    Returns
    -------
    Array of that shape; NaN beyond κ_max or the reach of the shortest wavelength, since a table
    never extrapolates; 0 beyond the table's `frequency_limit`.
    """
    others, zeroth, cosine = window_sums(table, qx, qy, kappa, place)
    return np.asarray(others + zeroth + 2.0 * cosine * np.sqrt(others * zeroth))


def window_sums(
    table: DiffractionTable,
    qx: ArrayLike,
    qy: ArrayLike,
    kappa: ArrayLike,
    place: ArrayLike | None = None,
) -> tuple[NDArray[np.float64], ...]:
    """`window_sum` of all orders but 0, of order 0, and the cosine of the phase between both.

    The cosine is 0 where powers add up.
    """
    coordinates = [qx, qy, kappa]
    if place is not None:
        if not table.grid.coherent:
            raise DiffractionError("a window can only be moved in a table with coherence='patch'")
        coordinates += [np.asarray(place, float)[..., axis] for axis in (0, 1)]
    qx, *rest = np.broadcast_arrays(*(np.asarray(a, float) for a in coordinates))
    flat = [np.ravel(a) for a in (qx, *rest)]
    result = np.empty((3, flat[0].size))
    for start in range(0, flat[0].size, _CHUNK):
        part = slice(start, start + _CHUNK)
        result[:, part] = _window_sums(table, *(a[part] for a in flat))
    return tuple(part.reshape(qx.shape) for part in result)


def brdf(
    table: DiffractionTable,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    height_scale: float = 1.0,
    place: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """The BRDF for R = 1 from the table, 1/sr: the twin of `reference.brdf`, same shapes.

    place : see `window_sum`.
    """
    k = wavenumber(wavelength)
    u, v, w = diffraction_coordinates(wi, wo)
    above = (np.asarray(wi)[..., 2] > 0) & (np.asarray(wo)[..., 2] > 0)
    u, v, w = (np.where(above, c, 0.0) for c in (u, v, w))
    others, zeroth, phase = window_sums(table, k * u, k * v, k * w * height_scale, place)
    factor = 4 * np.pi**2 * table.sigma**4 * kirchhoff_factor(wi, wo, wavelength, table.sigma)
    cos_i, cos_o = (np.where(above, np.asarray(each)[..., 2], 1.0) for each in (wi, wo))
    mirror = k**2 * table.sigma**2 / np.pi * np.where(above, zeroth, 0.0)
    others *= factor
    mirror *= horizon_correction(table.sigma_0 * cos_i**2, table.sigma_0 * cos_o**2, k)
    return np.asarray(others + mirror + 2.0 * phase * np.sqrt(others * mirror))


def _window_sums(
    table: DiffractionTable,
    qx: NDArray[np.float64],
    qy: NDArray[np.float64],
    kappa: NDArray[np.float64],
    *place: NDArray[np.float64],
) -> tuple[NDArray[np.float64], ...]:
    grid = table.grid
    kernels = (_gaussian(grid.exponents[0]), _gaussian(grid.exponents[1]))
    rest = weighted_sum(table, qx, qy, kappa, kernels, grid.taps, place)
    order_0 = order_0_sum(table, qx, qy, kappa, kernels)
    others, zeroth = np.maximum(rest.real, 0.0), np.maximum(order_0.real, 0.0)
    cosine = np.zeros_like(qx)
    if grid.coherent:
        others, zeroth = np.abs(rest) ** 2, np.abs(order_0) ** 2
        cosine = (rest * np.conj(order_0)).real / np.maximum(np.sqrt(others * zeroth), 1e-300)
    for part in (others, zeroth):
        part[~table.covers(qx, qy, kappa)] = 0.0
    others[~table.reachable(qx, qy, kappa)] = np.nan
    return others, zeroth, cosine


def weighted_sum(
    table: DiffractionTable,
    qx: NDArray[np.float64],
    qy: NDArray[np.float64],
    kappa: NDArray[np.float64],
    kernels: tuple[Kernel, Kernel],
    taps: tuple[int, int],
    place: Sequence[NDArray[np.float64]] = (),
) -> NDArray[Any]:
    """Σ_j≠0 of the series at κ times kernel_x(x − j_x)·kernel_y(y − j_y), with x = qx/dqx in bins.

    Only the `taps` bins nearest to (x, y) are read, less the corners that the table's own taps
    leave out; `order_0_sum` has order 0.

    Parameters
    ----------
    qx, qy, kappa : (n,), rad/µm, within the table's range.
    kernels : weight of a bin by its distance in bins, along x and y.
    taps : bins to read along x and y; at most as many as the table was built for.
    place : (x, y) of the window's centre in µm, each (n,), of a table of `patch`.

    Returns
    -------
    (n,): for `patch` a complex amplitude, for `ensemble` a power, also where the table stores
    amplitudes: these are squared first.
    """
    grid, expansion = table.grid, table.expansion
    interval = expansion.interval(kappa)
    weights = expansion.weights(kappa)
    scaled = weights / table.scale
    x, y = qx / table.spacing[0], qy / table.spacing[1]
    column, distance_x = taps_at(x, grid.last[0], taps[0])
    row, distance_y = taps_at(y, grid.last[1], taps[1])
    weight_x: NDArray[Any] = kernels[0](distance_x)
    weight_y: NDArray[Any] = kernels[1](distance_y)
    if place:  # rotates the table's phases, which belong to a window on the patch's centre
        weight_x = weight_x * _phases(column, taps[0], grid.last[0], place[0], table.spacing[0])
        weight_y = weight_y * _phases(row, taps[1], grid.last[1], place[1], table.spacing[1])

    total: Any = np.zeros(len(qx))
    columns = grid.tapped() if taps == grid.taps else [range(taps[0])] * taps[1]
    for j, row_columns in enumerate(columns):
        for i in row_columns:
            packet = table.coefficients[interval, row + j, column + i].astype(float)
            value = _bin_value(table, np.einsum("npt,nt->np", packet, scaled))
            total = total + weight_x[:, i] * weight_y[:, j] * value
    return np.asarray(total)


def order_0_sum(
    table: DiffractionTable,
    qx: NDArray[np.float64],
    qy: NDArray[np.float64],
    kappa: NDArray[np.float64],
    kernels: tuple[Kernel, Kernel],
) -> NDArray[Any]:
    """Return what order 0 adds to `weighted_sum`."""
    ratio = table.order_0_ratio
    x, y = qx / table.spacing[0], qy / table.spacing[1]
    lobe = ratio * (kernels[0](x) * kernels[1](y)) ** ratio
    return np.asarray(_bin_value(table, table.order_0_at(kappa)) * lobe)


def _bin_value(table: DiffractionTable, values: NDArray[np.float64]) -> NDArray[Any]:
    """Return the power or the complex amplitude, (n,), of numbers stored in a table."""
    if table.grid.coherent:
        return values[:, 0] + 1j * values[:, 1]
    return table.expansion.power_of(values)


def _phases(
    first: NDArray[np.int64], taps: int, last: int, place: NDArray[np.float64], spacing: float
) -> NDArray[np.complex128]:
    """exp(−i q_j (x₀ − L/2)) of the taps (n, taps) along an axis, L = 2π/spacing."""
    bins = first[:, None] + np.arange(taps) - last
    return np.exp(-1j * bins * (place * spacing - np.pi)[:, None])


def _gaussian(exponent: float) -> Kernel:
    return lambda distance: np.exp(-exponent * distance**2)
