"""Efficiencies between the nodes of a table, by its polynomials."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError
from . import cells
from .cells import Array, Cell
from .polarised import ODD, nearest_pure, smooth_elements
from .table import Band, OrderTable


def efficiency(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    *,
    from_below: bool = False,
    transmitted: bool = False,
) -> Array:
    """Return the efficiency of an order for unpolarised light, from the table's polynomials.

    Parameters
    ----------
    x, y : direction cosines within the superstrate of the mirror direction of the incident
        light, −(ωi)_x and −(ωi)_y.
    wavelength : in vacuum, nm.
    order : m; order m leaves at x + m λ/(n d) and y.
    from_below : whether the light comes from below a thin sheet.
    transmitted : whether the order leaves on the other side of a thin sheet.

    Returns
    -------
    (…) share of the incident light, 0 for orders that do not propagate.

    Raises
    ------
    DiffractionError
        If light below is asked for, and the table is that of no sheet.
    """
    both = polarised_efficiency(
        table, x, y, wavelength, order, from_below=from_below, transmitted=transmitted
    )
    return np.asarray(both.mean(axis=-1))


def polarised_efficiency(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    *,
    from_below: bool = False,
    transmitted: bool = False,
) -> Array:
    """Return the efficiencies for incident light of s and p polarisation, (…, 2).

    Arguments and errors as for `efficiency`.
    """
    return _values(
        table, x, y, wavelength, order, from_below, transmitted, lambda band, kind: band.kind(kind),
        clamped,
    )  # fmt: skip


def mueller(
    table: OrderTable, x: ArrayLike, y: ArrayLike, wavelength: ArrayLike, order: ArrayLike
) -> Array:
    """Return the Mueller matrices of an order, (…, 4, 4), about the axes of `polarised`.

    M₀₀ is `efficiency`. Arguments as for `efficiency`.

    Raises
    ------
    DiffractionError
        If the table has no Mueller matrices.
    """
    if not table.polarised:
        raise DiffractionError(
            "this table has efficiencies alone; solve the profile with --polarised for Mueller "
            "matrices"
        )
    light = (table, x, y, wavelength, order)
    elements = _values(*light, False, False, functools.partial(smooth_elements, table), np.asarray)
    factors = np.where(ODD.ravel(), np.asarray(y)[..., None], 1.0)
    return nearest_pure(
        (elements * factors).reshape(*elements.shape[:-1], 4, 4), efficiency(*light)
    )


def _values(
    table: OrderTable,
    x: ArrayLike,
    y: ArrayLike,
    wavelength: ArrayLike,
    order: ArrayLike,
    from_below: bool,
    transmitted: bool,
    of_kind: Callable[[Band, int], NDArray[Any]],
    finish: Callable[[Array], Array],
) -> Array:
    """Interpolate values of an order, (…, n), 0 where it does not propagate.

    of_kind : values (τ, ρ, w, j, q, n) of a band's kind.
    finish : applied to the rows (lanes, q, n) of all ports.
    """
    if (from_below or transmitted) and not table.thin:
        raise DiffractionError(
            "this table has reflected light alone; solve the profile with thin for that below"
        )
    x, y, lam, m = np.broadcast_arrays(*(np.asarray(value) for value in (x, y, wavelength, order)))
    shape = x.shape
    x, y, lam = (part.astype(np.float64).ravel() for part in (x, y, lam))
    lam = np.maximum(lam, table.wavelengths[0])  # shorter light may have orders beyond all bands
    cell = cells.to_cell(x, y, lam, table.optical_period)
    w = cells.w_of(cell.k_continuous, lam, table.wavelengths, table.optical_period)
    q = cell.channel - m.ravel().astype(np.int64)
    propagates = (cell.channel >= 0) & (q >= 0) & (q < cell.channels)
    result = np.zeros((len(x), of_kind(table.bands[0], cells.A).shape[-1]))
    for k in np.unique(cell.band):
        for kind in (cells.A, cells.B):
            here = np.flatnonzero(propagates & (cell.band == k) & (cell.kind == kind))
            if len(here):
                channels = int(k) + 1 - kind
                values = of_kind(table.bands[k], kind)
                rows = _polynomial(values, cell, w, here, channels * from_below)
                port = q[here] + channels * (from_below != transmitted)
                result[here] = finish(rows)[np.arange(len(here)), port]
    return result.reshape(*shape, result.shape[-1])


def _polynomial(
    nodes: NDArray[Any], cell: Cell, w: Array, here: NDArray[np.int64], first: int
) -> Array:
    """Return the rows of all ports of some lanes, (lanes, q, n); first : port of channel 0."""
    weights = [
        cells.interpolation(count, places[here])
        for count, places in zip(nodes.shape, (cell.tau, cell.rho, w), strict=False)
    ]
    rows = np.empty((len(here), *nodes.shape[4:]))
    for j in np.unique(cell.channel[here]):
        lanes = np.flatnonzero(cell.channel[here] == j)
        of_lanes = [matrix[lanes] for matrix in weights]
        values = nodes[:, :, :, first + j].astype(np.float64)
        rows[lanes] = np.einsum("na,nb,nc,abcqs->nqs", *of_lanes, values, optimize=True)
    return rows


def clamped(values: Array) -> Array:
    """Clamp efficiencies (…, q, 2) to at least 0, and their sums over q to at most 1."""
    positive = np.maximum(values, 0.0)
    total = positive.sum(axis=-2, keepdims=True)
    return np.asarray(positive / np.maximum(total, 1.0))
