"""`read_orders`: a table of orders from efficiencies of another solver, or of a bench."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError, warn
from ..tables.orders import Band, CrossedTable, OrderTable, cells
from ..tables.orders.table import MOST_NODES, S_AND_P, Counts, check_outline
from .efficiencies import Efficiencies, read_efficiencies
from .measured_crossed import crossed_table, warn_of_gaps
from .nodes import kinds_of
from .samples import check_orders, interpolated, missed_shares, warn_of_one_way
from .stations import Real

#: Nodes of the table, to which samples are interpolated linearly.
COUNTS = Counts(12, 8, 4)
#: Nodes along ρ at least of the table of one direction: a curve over wavelength, for each order.
_LEAST_RHO = 4
#: Error of efficiencies of the light in the file that is worth a change at nodes as large as 1.
_MISSED = 1e-3
#: Distance from grazing, in p, within which rounding decides whether an order propagates.
_EDGE = 1e-6
#: Decimals of s that tell directions apart.
_DIGITS = 9


class _Samples(NamedTuple):
    """Light of the file, (n,) each, in the coordinates of `cells`.

    Attributes
    ----------
    x, y, wavelength : direction cosines of the mirror direction, and nm in vacuum.
    cell, w : its coordinates.
    s : x/c, which one direction has at all wavelengths.
    orders : (m,) whole numbers.
    powers : (n, m, 2), or (n, m, 4) of a sheet; 0 where an order does not propagate.
    """

    x: Real
    y: Real
    wavelength: Real
    cell: cells.Cell
    w: Real
    s: Real
    orders: NDArray[np.int64]
    powers: Real

    def of_order(self, order: int) -> Real:
        """Return the efficiencies of an order, (n, 2) or (n, 4); 0 if no light has it."""
        place = np.searchsorted(self.orders, order)
        if place == len(self.orders) or self.orders[place] != order:
            return np.zeros((len(self.x), self.powers.shape[-1]))
        return self.powers[:, place]


def read_orders(
    path: str | os.PathLike[str],
    period: float | tuple[float, float],
    *,
    superstrate: float = 1.0,
) -> OrderTable | CrossedTable:
    """Return the table of orders of a file of efficiencies; see `solve.efficiencies`.

    A file with order_x and order_y makes the table of a crossed grating, of reflected light without
    polarisation (`solve.measured_crossed`).

    Where the file has light in the plane across the grooves alone (φ = 0), conical light gets the
    efficiencies of the in-plane light with the same orders. That is exact for perfect conductors.
    Directions that the file lacks, all but one perhaps, get the efficiencies of the nearest
    direction in it, order by order. A warning says either.

    With T_s and T_p the table describes a thin sheet. Its transmission from below follows from
    reciprocity; it reflects light from below as light from above, at most the remaining power.

    Raises a DiffractionError if the file cannot be read, or its grid has holes; if it has orders
    that do not propagate, lacks one that does, or has efficiencies that are negative or sum to
    above 1.001.

    Parameters
    ----------
    path : long CSV, or NetCDF.
    period : µm; of a crossed grating along x and along y, or one number for both.
    superstrate : index of the medium above, to which θ and φ belong; 1 of a crossed grating.
    """
    header: dict[str, Any] = {
        "solver": f"imported from {Path(path).name}", "material": "unknown", "profile": "unknown",
    }  # fmt: skip
    grid, shown = read_efficiencies(path), repr(os.fspath(path))
    if grid.orders.ndim == 2:
        if superstrate != 1.0:
            raise DiffractionError(
                f"superstrate={superstrate:g}: crossed gratings lie in air; leave it out, and give "
                "the angles in air"
            )
        periods = period if isinstance(period, tuple) else (period, period)
        crossed = crossed_table(grid, periods, shown, header)
        warn_of_gaps(crossed, grid, shown)
        return crossed
    if isinstance(period, tuple):
        raise DiffractionError(
            f"period={period[0]:g},{period[1]:g} µm: {shown} has the orders of grooves, with one "
            "period; crossed gratings have order_x and order_y"
        )
    return table_of(grid, period, superstrate, shown, header)


def table_of(
    grid: Efficiencies, period: float, superstrate: float, shown: str, header: dict[str, Any]
) -> OrderTable:
    """Return the table of a grid of efficiencies; its errors are added to the header.

    shown : source of the grid, for messages. Other arguments and errors as for `read_orders`.
    """
    wavelengths = float(grid.wavelengths[0]), float(grid.wavelengths[-1])
    thin = grid.values.shape[-1] == 4
    check_outline(period, wavelengths, superstrate, thin)
    samples = _samples(grid, superstrate * period, shown)
    in_plane = bool((np.abs(np.sin(np.radians(grid.phi))) < 1e-9).all())
    last = cells.largest_band(wavelengths, superstrate * period)
    incomplete = _lacks_directions(samples, last)
    if incomplete:
        warn(
            f"{shown} has no light from some directions, which get the efficiencies of the nearest "
            "direction in it; list theta from -85 to 85 in steps of 5 or 10 to have all of them"
        )
    elif in_plane:
        warn(
            f"{shown} has light across the grooves only (phi = 0): other light gets the same "
            "efficiencies, which is exact for perfect conductors alone"
        )
    counts = [Counts(*COUNTS[:2], 1 if in_plane or len(grid.wavelengths) == 1 else COUNTS.w)] * (
        last + 1
    )
    if len(np.unique(samples.s)) == 1:
        counts = [_of_one_direction(samples.cell, k) for k in range(last + 1)]
    bands = tuple(_band(k, of_band, samples) for k, of_band in enumerate(counts))
    table = OrderTable(period, wavelengths, bands, superstrate, header, thin, S_AND_P)
    header |= _errors(table, samples)
    if not incomplete:
        warn_of_one_way(header["reciprocity_error"], shown)
    return table


def _of_one_direction(cell: cells.Cell, band: int) -> Counts:
    """Return nodes for curves over K, some four for each wavelength in the band."""
    big_k = cell.k_continuous
    in_band = 4.0 * len(big_k) / max(float(np.ptp(big_k)), 1.0 / MOST_NODES)
    lit = (cell.band == band).any()
    return Counts(2, int(min(max(in_band, _LEAST_RHO), MOST_NODES)) if lit else _LEAST_RHO, 1)


def _samples(grid: Efficiencies, optical_period: float, shown: str) -> _Samples:
    """Return all light in the coordinates of the table; check that its orders propagate."""
    axes = np.meshgrid(grid.wavelengths, grid.theta, grid.phi, indexing="ij")
    lam, theta, phi = (axis.ravel() for axis in axes)
    sine = np.sin(np.radians(theta))
    x, y = -sine * np.cos(np.radians(phi)), sine * np.sin(np.radians(phi))
    values = grid.values.reshape(len(lam), len(grid.orders), -1)
    # order m lies at p − m, which 0 to K hold
    step, room = lam / (1e3 * optical_period), np.sqrt(1.0 - y**2)
    lowest, highest = ((side * room - x) / step for side in (-1.0, 1.0))

    def propagates(orders: NDArray[np.int64], edge: float) -> NDArray[np.bool_]:
        above = orders >= lowest[:, None] - edge * _EDGE
        return np.asarray(above & (orders <= highest[:, None] + edge * _EDGE))

    every = np.arange(int(np.floor(lowest.min())), int(np.ceil(highest.max())) + 1)
    signs = "the period, and the signs of the orders and of theta"
    check_orders(grid, values.reshape(*values.shape[:2], -1, 2), every, propagates, signs, shown)
    powers = np.maximum(np.nan_to_num(values), 0.0)
    cell = cells.to_cell(x, y, lam, optical_period)
    ends = float(lam.min()), float(lam.max())
    w = cells.w_of(cell.k_continuous, lam, ends, optical_period)
    s = np.round(x / room, _DIGITS)
    return _Samples(x, y, lam, cell, w, s, grid.orders, powers)


def _errors(table: OrderTable, samples: _Samples) -> dict[str, float]:
    """Compare a table with the file, unpolarised, as `accuracy.measured_error` does with solutions.

    Light at which a single order propagates is left out, unless there is no other.

    Reversed light is compared in all orders but 0, reflected: η_m(ωi) = η_m(−ωo), where the file
    has light as oblique as the reversed light. Its error is a share of the light.
    """
    x, y, lam = samples.x, samples.y, samples.wavelength
    missed, light, turned, sent = np.zeros(len(x)), np.zeros(len(x)), 0.0, 0.0
    oblique = np.hypot(x, y).max()
    lone = not samples.powers[:, samples.orders != 0].any()
    for order in samples.orders.tolist():
        if order == 0 and not lone:
            continue
        truth = samples.of_order(order)
        reflected = table.efficiency(x, y, lam, order)
        found = [reflected]
        if table.thin:
            found.append(table.efficiency(x, y, lam, order, transmitted=True))
        for side, got in enumerate(found):
            share = truth[:, 2 * side : 2 * side + 2].mean(axis=-1)
            missed, light = missed + np.abs(got - share), light + share
        if order:
            out = x + order * lam / (1e3 * table.optical_period)
            known = np.hypot(out, y) <= oblique
            back = table.efficiency(-out[known], y[known], lam[known], order)
            turned += float(np.abs(back - reflected[known]).sum())
            sent += float(reflected[known].sum())
    mean, worst = missed_shares(missed, light)
    one_way = turned / max(sent, 1e-12)
    return {"error_mean": mean, "error_worst": worst, "reciprocity_error": one_way}


def _lacks_directions(samples: _Samples, last: int) -> bool:
    """Whether some set of orders propagates in no light of the file, though its band is listed."""
    cell = samples.cell
    present = set(zip(cell.band.tolist(), cell.kind.tolist(), cell.channel.tolist(), strict=True))
    return any(
        (k, kind, j) not in present
        for k in range(int(cell.band.min()), last + 1)
        for kind in kinds_of(k)
        for j in range(k + 1 - kind)
    )


def _band(k: int, counts: Counts, samples: _Samples) -> Band:
    """Interpolate a band, each segment between kinks from its own samples."""
    return Band(k, *(_kind(k, kind, counts, samples) for kind in kinds_of(k)))


def _kind(k: int, kind: int, counts: Counts, samples: _Samples) -> NDArray[np.float32]:
    size, axes = k + 1 - kind, 2 if counts.w == 1 else 3
    grid = np.meshgrid(*(cells.nodes(count) for count in counts), indexing="ij")
    places = np.stack(grid, axis=-1)[..., :axes]
    values = np.zeros((*counts, size, size, samples.powers.shape[-1]))
    cell = samples.cell
    coordinates = np.stack([cell.tau, cell.rho, samples.w], axis=-1)[:, :axes]
    several = len(np.unique(samples.s)) > 1
    for j in range(size):
        here = np.flatnonzero((cell.band == k) & (cell.kind == kind) & (cell.channel == j))
        if k < cell.band.min():
            # nearer to the grooves' direction than all light of the file: a mirror
            lowest = samples.powers[cell.band == cell.band.min()]
            values[:, :, :, j, j] = lowest.sum(axis=1).mean(axis=0)
        elif len(here) and several:
            known = np.stack([samples.of_order(j - q)[here] for q in range(size)], axis=1)
            values[:, :, :, j] = interpolated(coordinates[here], known, places)
        else:
            big_k = k + cells.sine_squared(grid[1])
            s = cells.from_cell(k, kind, j, grid[0], grid[1], 2e3 / big_k, 1.0).x  # at c = 1
            for q in range(size):
                values[:, :, :, j, q] = _of_nearest_direction(samples, j - q, s, big_k)
    if not several and (cell.band == k).any():
        values = _through_samples(k, counts, samples, values)
    return (values if values.shape[-1] == 2 else _sheet(values)).astype(np.float32)


def _sheet(values: Real) -> Real:
    """Return the efficiencies between the ports of a sheet; see `read_orders`.

    values : (τ, ρ, w, j, q, 4) reflected and transmitted light from above.
    """
    reflected, through = values[..., :2], values[..., 2:]
    reverse = np.flip(through, (0, 3, 4)).swapaxes(3, 4).mean(axis=-1, keepdims=True)
    back = np.broadcast_to(reverse, through.shape)
    left = np.maximum(1.0 - back.sum(axis=-2, keepdims=True), 0.0)
    total = np.maximum(reflected.sum(axis=-2, keepdims=True), 1e-12)
    below = reflected * np.minimum(left / total, 1.0)
    rows = [np.concatenate(row, axis=-2) for row in ((reflected, through), (back, below))]
    return np.concatenate(rows, axis=-3)


def _of_nearest_direction(samples: _Samples, order: int, s: Real, big_k: Real) -> Real:
    """Return the efficiency of an order in the light of the file nearest in s, at the same K.

    s, big_k : of one shape (…). Returns (…, 2), of s and p, or (…, 4) of a sheet.
    """
    listed = np.unique(samples.s)
    nearest = np.abs(s[..., None] - listed).argmin(axis=-1)
    powers = samples.of_order(order)
    values = np.zeros((*s.shape, powers.shape[1]))
    for number in np.unique(nearest):
        light = np.flatnonzero(samples.s == listed[number])
        light = light[np.argsort(samples.cell.k_continuous[light])]
        here = nearest == number
        for kind, column in enumerate(powers[light].T):
            values[here, kind] = np.interp(big_k[here], samples.cell.k_continuous[light], column)
    return values


def _through_samples(k: int, counts: Counts, samples: _Samples, values: Real) -> Real:
    """Change values (τ, ρ, w, j, q, n) of light from one direction so that they meet the file's.

    Least squares of the changes at nodes, of which many lie at wavelengths beyond the file's, and
    of the errors over `_MISSED`.
    """
    here = np.flatnonzero(samples.cell.band == k)
    rho = cells.interpolation(counts.rho, samples.cell.rho[here])
    gain = rho.T @ np.linalg.inv(rho @ rho.T + _MISSED**2 * np.eye(len(here)))
    size = values.shape[3]
    orders = np.subtract.outer(np.arange(size), np.arange(size))
    known = np.stack([samples.of_order(int(m))[here] for m in orders.ravel()], axis=1)
    known = known.reshape(len(here), size, size, -1)
    missed = known - np.einsum("sr,rjqn->sjqn", rho, values[0, :, 0])
    changed = np.maximum(values + np.einsum("rs,sjqn->rjqn", gain, missed)[None, :, None], 0.0)
    kinds = changed.reshape(*changed.shape[:5], -1, 2)  # reflected, and transmitted; s and p
    total = kinds.sum(axis=(4, 5), keepdims=True)
    return np.asarray((kinds / np.maximum(total, 1.0)).reshape(changed.shape))
