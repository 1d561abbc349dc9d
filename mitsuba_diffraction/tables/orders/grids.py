"""Even grids of a table that the renderer interpolates linearly, with its coat included.

Along w they reach over the wavelengths at which light of some K comes from outside of the coat:
c is at least √(1 − 1/n²).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...optics.coat import face_transmittance
from ...optics.orders import least_c
from . import blocks, cells
from .cells import Array
from .crossed import corner_records
from .lookup import clamped
from .polarised import smooth_elements
from .table import Band, Counts, OrderTable

#: Cells along τ, ρ and w, if the corners take no more memory than this. Linear interpolation in as
#: many cells is off by less than 0.1 % of the light on gratings as deep as λ/4. Under a coat the
#: critical angles of orders lie along w.
CELLS, CELLS_UNDER_COAT, MOST_BYTES = Counts(32, 24, 6), Counts(16, 12, 16), 96 << 20
#: Share of the light that a totally reflecting face sends back: trapped light would never end.
_TRAPPED = 1.0 - 1e-4
#: Least transmittance in probabilities, so that no order that leaves has none.
_MIN_TRANSMITTANCE = 1e-3


class Corners(NamedTuple):
    """Rows of efficiencies at the corners of cells, for one gather of 8 or 16 numbers.

    Attributes
    ----------
    cells : numbers of cells along τ, ρ and w.
    starts : (2 × bands,) first record of kind A and B of each band.
    values : (records, 8) float16, at the corners (τ, ρ, w) = 000, 001, 010 … 111 of a cell. Of n
        channels a cell has n rows of n + 1 records: efficiencies of the channels, and their sum.
        Under a coat (records, 16): efficiencies without the transmittances of the coat's face, and
        the probabilities of drawing, which have that towards q; the sum is that of the latter.
    """

    cells: Counts
    starts: NDArray[np.uint32]
    values: NDArray[np.float16]


class Matrices(NamedTuple):
    """Mueller matrices of the grating alone on the even grids.

    Attributes
    ----------
    starts : (2 × bands,) first record of kind A and B of each band.
    values : (records, 16) float16, `polarised.smooth_elements` of each node (τ, ρ, w) and each pair
        of ports (j, q).
    """

    starts: NDArray[np.uint32]
    values: NDArray[np.float16]


class Rows(NamedTuple):
    """Efficiencies on an even grid, (τ, ρ, w, j, q) from 0 to 1.

    Attributes
    ----------
    within : of the grating, with all reflections between the coat's face and the grating.
    through : times the face's transmittance towards q.
    """

    within: Array
    through: Array


def middles(nodes: NDArray[Any]) -> NDArray[Any]:
    """Interpolate values at the corners of cells (τ, ρ, w, …) linearly to the cells' middles."""
    for axis in range(3):
        along = np.moveaxis(nodes, axis, 0)
        nodes = np.moveaxis(0.5 * (along[:-1] + along[1:]), 0, axis)
    return nodes


def corners(table: OrderTable) -> Corners:
    """Resample a table for the renderer; a block's has even nodes, and reduced efficiencies."""
    if table.block:
        within = Counts(*(n - 1 for n in table.bands[0].counts))
        reduced = functools.partial(blocks.reduced, table)
        return Corners(within, *_stacked(table, lambda *of: corner_records(reduced(*of))))
    counts = _cells(table)

    def records(band: Band, kind: int) -> NDArray[np.float16]:
        of_kind = rows(table, band, kind, counts)
        parts = of_kind if table.superstrate != 1.0 else of_kind[:1]
        return np.concatenate([corner_records(part) for part in parts], axis=-1)

    return Corners(counts, *_stacked(table, records))


def matrices(table: OrderTable, counts: Counts) -> Matrices:
    """Resample the Mueller matrices of a polarised table on grids of so many cells."""

    def records(band: Band, kind: int) -> NDArray[np.float16]:
        elements = smooth_elements(table, band, kind)
        even = _resampled(table, band, elements, _grid(table, band, counts))
        return even.astype(np.float16).reshape(-1, 16)

    return Matrices(*_stacked(table, records))


def _stacked(
    table: OrderTable, records: Callable[[Band, int], NDArray[np.float16]]
) -> tuple[NDArray[np.uint32], NDArray[np.float16]]:
    """Return the first record of each kind of each band, and all records."""
    kinds = [(band, kind) for band in table.bands for kind in range(len(band.kinds))]
    parts = [records(band, kind) for band, kind in kinds]
    parts[1:1] = [parts[0][:0]]  # kind B of band 0 has none
    starts = np.cumsum([0, *map(len, parts[:-1])])
    return starts.astype(np.uint32), np.concatenate(parts)


def rows(table: OrderTable, band: Band, kind: int, counts: Counts) -> Rows:
    """Evaluate the polynomials of a kind on a grid with so many cells, unpolarised."""
    grid = _grid(table, band, counts)
    unpolarised = band.kind(kind).mean(axis=-1, dtype=np.float64)
    summed = _resampled(table, band, unpolarised, grid)
    values: Array = clamped(np.asarray(summed, np.float64)[..., None])[..., 0]
    if table.superstrate == 1.0:
        return Rows(values, values)
    channels = np.arange(values.shape[-1])
    places = grid.tau[:, None, None, None], grid.rho[:, None, None]
    lam = grid.wavelength[..., None]
    light = cells.from_cell(band.k, kind, channels, *places, lam, table.optical_period)
    through = leaving_transmittance(light.x**2 + light.y**2, table.superstrate)
    # The face keeps directions: light of channel q comes back in channel q. Its layer is too thick
    # to interfere (optics.coat), so that powers add up: (1 − E R)⁻¹ E
    back = _TRAPPED * (1.0 - through)
    repeated = np.eye(len(channels)) - values * back[..., None, :]
    within = np.asarray(np.linalg.solve(repeated, values), np.float64)
    return Rows(within, within * np.maximum(through, _MIN_TRANSMITTANCE)[..., None, :])


class _Grid(NamedTuple):
    """Even grid of a band: τ (t,), ρ (r,), K (r, 1) and wavelength (r, w), vacuum, nm."""

    tau: Array
    rho: Array
    big_k: Array
    wavelength: Array


def _grid(table: OrderTable, band: Band, counts: Counts) -> _Grid:
    tau, rho, w = (np.linspace(0.0, 1.0, count + 1) for count in counts)
    big_k = (band.k + cells.sine_squared(rho))[:, None]
    return _Grid(tau, rho, big_k, wavelength_of(table, big_k, w))


def _resampled(table: OrderTable, band: Band, values: NDArray[Any], grid: _Grid) -> Array:
    """Evaluate the polynomials of values (τ, ρ, w, …) at nodes of a band on a grid."""
    along_tau, along_rho = (
        cells.interpolation(known, places)
        for known, places in zip(band.counts, grid[:2], strict=False)
    )
    summed = np.einsum("ta,rb,abc...->trc...", along_tau, along_rho, values, optimize=True)
    at = cells.w_of(grid.big_k, grid.wavelength, table.wavelengths, table.optical_period)
    along_w = cells.interpolation(band.counts.w, at)
    return np.asarray(np.einsum("rwc,trc...->trw...", along_w, summed, optimize=True))


def wavelength_of(table: OrderTable, big_k: Array, w: Array) -> Array:
    """Return the wavelength (vacuum, nm) at w of the even grids."""
    period, least = table.optical_period, least_c(table.superstrate)
    return cells.wavelength_of(big_k, w, table.wavelengths, period, least)


def leaving_transmittance(squared_sine: Array, index: float) -> Array:
    """Return the unpolarised transmittance of a coat's face for light within; 0 if all returns.

    squared_sine : of the angle within the coat.
    """
    outside = index**2 * squared_sine
    cosine = np.sqrt(np.maximum(1.0 - outside, 0.0))
    return np.where(outside < 1.0, face_transmittance(np.maximum(cosine, 1e-9), index), 0.0)


def _cells(table: OrderTable) -> Counts:
    """Return the numbers of cells that fit into memory."""
    counts, size = (CELLS, 16) if table.superstrate == 1.0 else (CELLS_UNDER_COAT, 32)
    if table.superstrate == 1.0 and all(band.counts == (1, 1, 1) for band in table.bands):
        counts = Counts(1, 1, 1)
    ports = (kind.shape[3] for band in table.bands for kind in band.kinds)
    records = sum(n * (n + 1) for n in ports)
    while size * records * math.prod(counts) > MOST_BYTES and max(counts) > 4:
        counts = Counts(*(max(min(n, 4), 3 * n // 4) for n in counts))
    return counts
