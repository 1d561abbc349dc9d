"""Efficiencies between the nodes of a table, by its polynomials."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError
from . import cells
from .cells import Array, Cell
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
    result = np.zeros((len(x), 2))
    for k in np.unique(cell.band):
        for kind in (cells.A, cells.B):
            here = np.flatnonzero(propagates & (cell.band == k) & (cell.kind == kind))
            if len(here):
                channels = int(k) + 1 - kind
                rows = _polynomial(table.bands[k], kind, cell, w, here, channels * from_below)
                port = q[here] + channels * (from_below != transmitted)
                result[here] = clamped(rows)[np.arange(len(here)), port]
    return result.reshape(*shape, 2)


def _polynomial(
    band: Band, kind: int, cell: Cell, w: Array, here: NDArray[np.int64], first: int
) -> Array:
    """Return the rows of all ports of some lanes, (n, q, 2); first : port of channel 0."""
    counts = band.counts
    weights = [
        cells.interpolation(count, places[here])
        for count, places in zip(counts, (cell.tau, cell.rho, w), strict=True)
    ]
    rows = np.empty((len(here), band.kind(kind).shape[4], 2))
    for j in np.unique(cell.channel[here]):
        lanes = np.flatnonzero(cell.channel[here] == j)
        of_lanes = [matrix[lanes] for matrix in weights]
        values = band.kind(kind)[:, :, :, first + j].astype(np.float64)
        rows[lanes] = np.einsum("na,nb,nc,abcqs->nqs", *of_lanes, values, optimize=True)
    return rows


def clamped(values: Array) -> Array:
    """Clamp efficiencies (…, q, 2) to at least 0, and their sums over q to at most 1."""
    positive = np.maximum(values, 0.0)
    total = positive.sum(axis=-2, keepdims=True)
    return np.asarray(positive / np.maximum(total, 1.0))
