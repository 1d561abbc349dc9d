"""Table of a crossed grating from the efficiencies of another solver, or of a bench."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial import KDTree

from ..errors import DiffractionError, warn
from ..tables.orders import CrossedTable
from ..tables.orders.crossed import (
    MOST_WAVELENGTHS,
    NODES,
    all_orders,
    most_orders,
    propagates,
)
from .efficiencies import Efficiencies
from .samples import check_orders, interpolated, missed_shares, warn_of_one_way
from .stations import Real

#: Widest gap between azimuths, degrees, that needs no warning.
_WIDEST_GAP = 90.0


def crossed_table(
    grid: Efficiencies, periods: tuple[float, float], shown: str, header: dict[str, Any]
) -> CrossedTable:
    """Return the table of a grid of efficiencies; its errors are added to the header.

    shown : source of the grid, for messages.

    Raises a DiffractionError if orders have light that do not propagate, or some that do are
    missing; if orders sum to over 1.001, or the file has transmitted light.
    """
    if grid.values.shape[-1] == 4:
        raise DiffractionError(
            f"{shown} has T_s and T_p: tables of crossed gratings hold reflected light alone; "
            "leave these columns out"
        )
    wavelengths = float(grid.wavelengths[0]), float(grid.wavelengths[-1])
    last = most_orders(periods, wavelengths)
    mirror = _mirror(grid)
    # (λ, direction, order) of unpolarised light
    known = grid.values.mean(axis=-1).reshape(len(grid.wavelengths), len(mirror), -1)

    def propagates_at(orders: NDArray[np.int64], edge: float) -> NDArray[np.bool_]:
        share = 1.0 - 1e-6 * edge
        light = grid.wavelengths * share, mirror * share
        return _open(*light, (orders[:, 0], orders[:, 1]), periods).reshape(-1, len(orders))

    signs = "the periods, and the signs of the orders, of theta and of phi"
    each = known.reshape(-1, known.shape[-1], 1, 1)
    check_orders(grid, each, np.column_stack(_orders(last)), propagates_at, signs, shown)
    powers = _dense(grid, known, last)
    filled = _filled(powers, grid.wavelengths, mirror, periods, last)
    table = CrossedTable(
        periods, wavelengths, _nodes(filled, grid.wavelengths, mirror, last), header
    )
    header |= _errors(table, powers, grid.wavelengths, mirror)
    return table


def warn_of_gaps(table: CrossedTable, grid: Efficiencies, shown: str) -> None:
    """Warn of azimuths that a file lacks, and of light without reciprocity.

    Arguments as of `crossed_table`.
    """
    mirror = _mirror(grid)
    bearings = np.unique(np.round(np.degrees(np.arctan2(mirror[:, 1], mirror[:, 0])) % 360.0, 6))
    if np.diff(bearings, append=bearings[0] + 360.0).max() > _WIDEST_GAP:
        warn(
            f"{shown} has no light from some azimuths, which get the efficiencies of the nearest "
            "direction in it; list phi from 0 to 345 in steps of 15"
        )
    warn_of_one_way(table.header["reciprocity_error"], shown)


def _mirror(grid: Efficiencies) -> Real:
    """Return the tangential parts (θ × φ, 2) of the mirror directions of a grid's light."""
    theta, phi = np.meshgrid(np.radians(grid.theta), np.radians(grid.phi), indexing="ij")
    return np.asarray(-(np.sin(theta) * [np.cos(phi), np.sin(phi)]).reshape(2, -1).T)


def _orders(last: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return m_x and m_y of all orders of a table, (orders,) each."""
    m_x, m_y = all_orders(last)
    return m_x.ravel(), m_y.ravel()


def _open(
    wavelengths: Real,
    mirror: Real,
    orders: tuple[NDArray[Any], NDArray[Any]],
    periods: tuple[float, float],
) -> NDArray[np.bool_]:
    """Whether orders propagate, (λ, direction, order)."""
    x, y = mirror.T[:, None, :, None]
    return propagates(x, y, wavelengths[:, None, None], *orders, periods)


def _dense(grid: Efficiencies, known: Real, last: tuple[int, int]) -> Real:
    """Return efficiencies (λ, direction, order) of all orders of the table; 0 where unlisted."""
    m_x, m_y = _orders(last)
    powers = np.zeros((*known.shape[:2], len(m_x)))
    for n, (a, b) in enumerate(grid.orders):
        if abs(a) <= last[0] and abs(b) <= last[1]:
            powers[..., np.flatnonzero((m_x == a) & (m_y == b))[0]] = known[..., n]
    return np.maximum(np.nan_to_num(powers), 0.0)


def _filled(
    powers: Real, wavelengths: Real, mirror: Real, periods: tuple[float, float],
    last: tuple[int, int],
) -> Real:  # fmt: skip
    """Give orders that do not propagate the light of the nearest direction where they do.

    Interpolation between the two sides of a Rayleigh anomaly would halve the light on one side.
    These additions may bring the sum of a direction to 1, no further.
    """
    lit = _open(wavelengths, mirror, _orders(last), periods)
    filled = powers.copy()
    for n, order in np.argwhere(lit.any(axis=1) & ~lit.all(axis=1)):
        here = np.flatnonzero(lit[n, :, order])
        dark = np.flatnonzero(~lit[n, :, order])
        nearest = KDTree(mirror[here]).query(mirror[dark])[1]
        filled[n, dark, order] = powers[n, here[nearest], order]
    known = powers.sum(axis=-1, keepdims=True)
    added = filled - powers
    room = np.maximum(1.0 - known, 0.0) / np.maximum(added.sum(axis=-1, keepdims=True), 1e-12)
    return np.asarray(powers + added * np.minimum(room, 1.0))


def _nodes(filled: Real, wavelengths: Real, mirror: Real, last: tuple[int, int]) -> Any:
    """Return the values of the table's even grid."""
    if len(wavelengths) == 1:
        along = np.repeat(filled, 2, axis=0)
    else:
        count = 1 + round(float(np.ptp(wavelengths) / np.diff(wavelengths).min()))
        even = np.linspace(wavelengths[0], wavelengths[-1], min(count, MOST_WAVELENGTHS))
        along = make_interp_spline(wavelengths, filled, k=1)(even)
    axis = np.linspace(-1.0, 1.0, NODES)
    y, x = np.meshgrid(axis, axis, indexing="ij")
    places = np.stack([x, y], axis=-1)
    points, first = np.unique(np.round(mirror, 9), axis=0, return_index=True)
    values = interpolated(points, along[:, first].swapaxes(0, 1), places)
    shape = (NODES, NODES, len(along), 2 * last[1] + 1, 2 * last[0] + 1)
    # weights of a triangle round to below 0 at its sides
    return np.moveaxis(np.maximum(values.reshape(shape), 0.0), 2, 0).astype(np.float32)


def _errors(table: CrossedTable, powers: Real, wavelengths: Real, mirror: Real) -> dict[str, float]:
    """Compare a table with the file, and light with reversed light, in all orders but 0.

    Without other orders, in order 0.
    """
    m_x, m_y = _orders(table.last_orders)
    others = (m_x != 0) | (m_y != 0)
    if not powers[..., others].any():
        others = ~others
    x, y = mirror.T[:, None, :, None]
    light = (wavelengths[:, None, None], m_x[others], m_y[others])
    got, truth = table.efficiency(x, y, *light), powers[..., others]
    d_x, d_y = table.periods
    out_x = x + light[1] * light[0] / (1e3 * d_x)
    out_y = y + light[2] * light[0] / (1e3 * d_y)
    # the file has light to compare with up to its last angle
    known = np.hypot(out_x, out_y) <= np.hypot(x, y).max()
    back = np.where(known, table.efficiency(-out_x, -out_y, *light), got)
    total = truth.sum(axis=-1)
    mean, worst = missed_shares(np.abs(got - truth).sum(axis=-1), total)
    one_way = float(np.abs(back - got).sum()) / max(float(total.sum()), 1e-12)
    return {"error_mean": mean, "error_worst": worst, "reciprocity_error": one_way}
