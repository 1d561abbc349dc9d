"""Even grids of a table, with its coat included: rows that the renderer and shaders interpolate.

Along w they reach over the wavelengths at which light of some K comes from outside of the coat:
c is at least √(1 − 1/n²).
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..optics.coat import face_transmittance
from ..optics.orders import least_c
from . import cells
from .cells import Conditions, Counts
from .response import Band, CellResponse, ListedResponse
from .table import OrderTable

#: Cells along τ, ρ and w, if the corners take no more memory than this. Linear interpolation in as
#: many cells is off by less than 0.1 % of the light on gratings as deep as λ/4. Under a coat the
#: critical angles of orders lie along w.
CELLS, CELLS_UNDER_COAT, MOST_BYTES = Counts(32, 24, 6), Counts(20, 14, 12), 96 << 20
#: Nodes along an axis above which a table, as of gold, has more cells there, and cells over nodes.
COMMON, SHARES = Counts(36, 24, 8), (1.25, 1.25, 2.0)
#: Share of the light that a totally reflecting face sends back: trapped light would never end.
_TRAPPED = 1.0 - 1e-4
#: Least transmittance in probabilities, so that no order that leaves has none.
_MIN_TRANSMITTANCE = 1e-3


class Rows(NamedTuple):
    """Efficiencies on an even grid, (τ, ρ, w, j, q) from 0 to 1.

    Attributes
    ----------
    within : of the grating; under a coat with all reflections between its face and the grating,
        times √N of the face for light of j and of q (`optics.coat.passage`).
    through : under a coat the same times T/√N towards q.
    """

    within: Real
    through: Real


class Kind(NamedTuple):
    """Kind of a band: the band's number, `cells.A` or `cells.B`, and its number of ports."""

    band: int
    kind: int
    ports: int


def kinds_of(table: OrderTable) -> Iterator[Kind]:
    """Yield all kinds of a table's cells, kind A of a band before its kind B."""
    for k in range(table.last_band + 1):
        for kind in (cells.A, cells.B) if k else (cells.A,):
            yield Kind(k, kind, table.sides * (k + 1 - kind))


def middles(nodes: NDArray[Any]) -> NDArray[Any]:
    """Interpolate values at the corners of cells (τ, ρ, w, …) linearly to the cells' middles."""
    for axis in range(3):
        along = np.moveaxis(nodes, axis, 0)
        nodes = np.moveaxis(0.5 * (along[:-1] + along[1:]), 0, axis)
    return nodes


def rows(table: OrderTable, of: Kind, counts: Counts, *, coated: bool = True) -> Rows:
    """Return the unpolarised efficiencies of a kind on a grid with so many cells."""
    table = on_cells(table)
    unpolarised = table.bands[of.band].kinds[of.kind][..., 0].astype(np.float64)
    values = clamped(resampled(table, of.band, unpolarised, counts, coated))
    if table.superstrate == 1.0 or not coated:
        return Rows(values, values)
    light = lights(table, of, counts, coated=coated)
    through = leaving_transmittance(light.x**2 + light.y**2, table.superstrate)
    # The face keeps directions: light of channel q comes back in channel q. Its layer is too thick
    # to interfere (optics.coat), so that powers add up: (1 − E R)⁻¹ E
    most = kept(table)
    back = _TRAPPED * (1.0 - through)
    repeated = np.eye(of.ports) - values * back[..., None, :]
    within = np.asarray(np.linalg.solve(repeated, values), np.float64)
    root = np.sqrt(1.0 - most * (1.0 - through))
    within *= root[..., :, None] * root[..., None, :]
    leaving = np.maximum(through, _MIN_TRANSMITTANCE) / root
    return Rows(within, within * leaving[..., None, :])


def kept(table: OrderTable) -> float:
    """Return ρ of `optics.coat.passage`: the largest sum of a grating's efficiencies, below 1."""
    table, most = on_cells(table), 0.0
    for of in kinds_of(table):
        values = clamped(table.bands[of.band].kinds[of.kind][..., 0].astype(np.float64))
        most = max(most, float(values.sum(axis=-1).max()))
    return min(most, _TRAPPED)


def resampled(
    table: OrderTable, k: int, values: NDArray[Any], counts: Counts, coated: bool
) -> Real:
    """Interpolate values (τ, ρ, w, …) at nodes of a band to a grid with so many cells."""
    assert isinstance(table.response, CellResponse)
    matrix = cells.linear if table.response.even else cells.interpolation
    known, (tau, rho, big_k, lam) = table.response.bands[k].counts, _grid(table, k, counts, coated)
    along_tau, along_rho = matrix(known.tau, tau), matrix(known.rho, rho)
    summed = np.einsum("ta,rb,abc...->trc...", along_tau, along_rho, values, optimize=True)
    at = cells.w_of(big_k, lam, table.wavelengths, table.optical_period)
    along_w = matrix(known.w, at)
    return np.asarray(np.einsum("rwc,trc...->trw...", along_w, summed, optimize=True), np.float64)


def clamped(values: Real) -> Real:
    """Clamp efficiencies (…, q) to at least 0, and their sums over q to at most 1."""
    positive = np.maximum(values, 0.0)
    total = positive.sum(axis=-1, keepdims=True)
    return np.asarray(positive / np.maximum(total, 1.0))


def _grid(table: OrderTable, k: int, counts: Counts, coated: bool) -> tuple[Real, Real, Real, Real]:
    """Return the even grid of a band: τ (t,), ρ (r,), K (r, 1) and wavelength (r, w), nm."""
    tau, rho, w = (np.linspace(0.0, 1.0, count + 1) for count in counts)
    big_k = (k + cells.sine_squared(rho))[:, None]
    return tau, rho, big_k, wavelength_of(table, big_k, w, coated=coated)


def lights(table: OrderTable, of: Kind, counts: Counts, *, coated: bool) -> Conditions:
    """Return the light (τ, ρ, w, j) of a kind's channels at the even grid of so many cells."""
    tau, rho, _, lam = _grid(table, of.band, counts, coated)
    places = tau[:, None, None, None], rho[:, None, None], lam[..., None]
    channels = np.arange(of.ports // table.sides)
    return cells.from_cell(of.band, of.kind, channels, *places, table.optical_period)


def wavelength_of(table: OrderTable, big_k: Real, w: Real, *, coated: bool = True) -> Real:
    """Return the wavelength (vacuum, nm) at w of the even grids.

    coated : whether they have the light from outside of the coat alone.
    """
    period, least = table.optical_period, least_c(table.superstrate if coated else 1.0)
    return cells.wavelength_of(big_k, w, table.wavelengths, period, least)


def leaving_transmittance(squared_sine: Real, index: float) -> Real:
    """Return the unpolarised transmittance of a coat's face for light within; 0 if all returns.

    squared_sine : of the angle within the coat.
    """
    outside = index**2 * squared_sine
    cosine = np.sqrt(np.maximum(1.0 - outside, 0.0))
    return np.where(outside < 1.0, face_transmittance(np.maximum(cosine, 1e-9), index), 0.0)


def cells_of(table: OrderTable, *, coated: bool) -> Counts:
    """Return the numbers of a look-up's cells, which fit into memory.

    coated : whether a coat is in the efficiencies, which the renderer and shaders read.
    """
    coated = coated and table.superstrate != 1.0
    counts, size = (CELLS_UNDER_COAT, 32) if coated else (CELLS, 16)
    most = (max(along) for along in zip(*(band.counts for band in table.bands), strict=True))
    counts = Counts(*(
        max(count, math.ceil(share * nodes)) if nodes > common else count
        for count, nodes, common, share in zip(counts, most, COMMON, SHARES, strict=True)
    ))  # fmt: skip
    if not coated and constant(table):
        counts = Counts(1, 1, 1)
    records = sum(of.ports * (of.ports + 1) for of in kinds_of(table))
    while size * records * math.prod(counts) > MOST_BYTES and max(counts) > 4:
        counts = Counts(*(max(min(n, 4), 3 * n // 4) for n in counts))
    return counts


def constant(table: OrderTable) -> bool:
    """Whether a table has a single node in each band."""
    response = table.response
    return isinstance(response, CellResponse) and all(b.counts == (1, 1, 1) for b in response.bands)


_on_cells: weakref.WeakKeyDictionary[OrderTable, OrderTable] = weakref.WeakKeyDictionary()


def on_cells(table: OrderTable) -> OrderTable:
    """Return a table over cells, for readers that need all channels of a Bloch wave together.

    Listed light is resampled, unpolarised, in `CELLS_UNDER_COAT`, and it is no longer exact at the
    listed lights. Crossed gratings have no cells.
    """
    response = table.response
    if not isinstance(response, ListedResponse):
        return table
    if table not in _on_cells:
        parts: dict[int, list[NDArray[np.float32]]] = {}
        for of in kinds_of(table):
            parts.setdefault(of.band, []).append(_sampled(table, of))
        bands = tuple(Band(k, *of_band) for k, of_band in parts.items())
        _on_cells[table] = OrderTable(
            table.periods, table.wavelengths, CellResponse(bands, even=True), table.superstrate,
            table.header, table.thin, table.block,
        )  # fmt: skip
    return _on_cells[table]


def _sampled(table: OrderTable, of: Kind) -> NDArray[np.float32]:
    """Return the efficiencies (τ, ρ, w, j, q, 1) of listed light at even nodes of a kind."""
    light = lights(table, of, CELLS_UNDER_COAT, coated=False)
    # just inside the horizon, where orders leave that end there
    x, y = (part[..., None] * ((table.block or 1.0) * (1.0 - 1e-6)) for part in light[:2])
    channels = np.arange(light.x.shape[-1])
    orders, sides = channels[:, None] - channels, range(table.sides)
    values = np.block([
        [table.efficiency(x, y, light.wavelength[..., None], orders, **table.passage(came, left))
         for left in sides]
        for came in sides
    ])  # fmt: skip
    return clamped(values)[..., None].astype(np.float32)
