"""Tables of listed light: of a file's efficiencies, or of solutions in some directions.

Efficiencies of s and p become elements of Mueller matrices about the axes of the grooves
(`polarised`), which have no special place at the normal: M₀₁ = ½(η_s − η_p) cos 2ψ and
M₀₂ = ½(η_s − η_p) sin 2ψ, with ψ from the axis e to that of s (`efficiency.turned_axes`).
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..errors import DiffractionError, warn
from ..optics.orders import crossed_square
from .cells import Array
from .efficiency import MIN_ANGLE, turned_axes
from .lists import ROUNDING, Efficiencies, read_efficiencies
from .table import LARGEST_SUM, ListedResponse, OrderTable, check_outline, orders_between

#: Difference between light and reversed light above which a file hardly holds powers: grids of 5 to
#: 45° have 0.02 to 0.14, efficiencies without the ratio of cosines 0.4 to 0.8.
_ONE_WAY = 0.2
#: Distance from grazing, in squared cosines, within which rounding decides whether an order
#: propagates.
_EDGE = 1e-6
#: Decimals of degrees that tell directions apart.
_DIGITS = 9
#: Widest gap between azimuths of a crossed grating, degrees, that needs no warning.
_WIDEST_GAP = 90.0


class Lights(NamedTuple):
    """Response of a grid of lights.

    Attributes
    ----------
    wavelengths, theta, phi : (a,), (b,), (c,) nm in vacuum, and degrees within the medium of the
        light; θ below 0 is light from the other side, φ + 180°.
    orders : (m, 2), m_x and m_y.
    values : (a, b, c, sides in, sides out, m, n) elements of Mueller matrices, as of
        `ListedResponse.values`; NaN where an order does not propagate.
    """

    wavelengths: Array
    theta: Array
    phi: Array
    orders: NDArray[np.int64]
    values: Array


def listed_table(
    lights: Lights,
    periods: tuple[float, float],
    header: dict[str, Any],
    *,
    superstrate: float = 1.0,
    thin: bool = False,
    block: float | None = None,
) -> OrderTable:
    """Return the table of a grid of lights; other arguments as of `OrderTable`."""
    response = _response(lights, periods, superstrate, block)
    ends = float(lights.wavelengths[0]), float(lights.wavelengths[-1])
    return OrderTable(periods, ends, response, superstrate, header, thin, block)


def _response(
    lights: Lights, periods: tuple[float, float], superstrate: float, block: float | None = None
) -> ListedResponse:
    """Return the lights on a grid without gaps."""
    crossed = bool(np.isfinite(periods[1]))
    theta, phi = _canonical(lights, crossed)
    polar = np.unique(theta)
    azimuths = np.unique(phi[theta > 0.0]) if (theta > 0.0).any() else np.zeros(1)
    first, last = lights.orders.min(axis=0), lights.orders.max(axis=0)
    orders = orders_between(first.tolist(), last.tolist())
    width = last[0] - first[0] + 1
    places = (lights.orders[:, 1] - first[1]) * width + lights.orders[:, 0] - first[0]
    a, b, c, came, left, _, n = lights.values.shape
    # directions (θ, φ) of the list at nodes of the grid; several at one node are mirror images
    sums = np.zeros((a, len(polar), len(azimuths), came, left, len(orders), n))
    found = np.zeros((len(polar), len(azimuths)), np.int64)
    spread = np.zeros((a, b, c, came, left, len(orders), n))
    spread[:] = np.nan
    spread[..., places, :] = lights.values
    for i, j in np.ndindex(b, c):
        row = int(np.searchsorted(polar, theta[i, j]))
        columns: Any = slice(None)
        if theta[i, j] > 0.0:
            columns = int(np.searchsorted(azimuths, phi[i, j]))
        found[row, columns] += 1
        value = spread[:, i, j]
        sums[:, row, columns] += value if isinstance(columns, int) else value[:, None]
    values = sums / np.maximum(found, 1)[:, :, None, None, None, None]
    values = _of_nearest_directions(values, found > 0, polar, azimuths)
    if crossed:  # a circle: nodes beyond 0 and 360°
        azimuths = np.concatenate([azimuths[-1:] - 360.0, azimuths, azimuths[:1] + 360.0])
        values = np.concatenate([values[:, :, -1:], values, values[:, :, :1]], axis=2)
    index = block or superstrate
    optical = [1e-3 / (period * (1.0 if block else superstrate)) for period in periods]
    axes = np.asarray(lights.wavelengths, np.float64), polar, azimuths
    stored = np.empty((*values.shape[:4], left * len(orders), n), np.float32)
    for side in range(came):
        factor = index if block and side == 0 else 1.0
        light = values[:, :, :, side].reshape(*values.shape[:3], left * len(orders), n)
        stored[:, :, :, side] = _filled(light, axes, np.tile(orders, (left, 1)), optical, factor)
    in_plane = not crossed and bool(np.isin(azimuths, (0.0, 180.0)).all())
    return ListedResponse(axes, orders, stored, in_plane)


def _canonical(lights: Lights, crossed: bool) -> tuple[Array, Array]:
    """Return θ from 0 and φ (b, c), degrees: φ to 180 on grooves, below 360 on crossed gratings."""
    theta, azimuth = np.meshgrid(lights.theta, lights.phi, indexing="ij")
    turned = (azimuth + np.where(theta < 0.0, 180.0, 0.0)) % 360.0
    phi = np.asarray(np.round(turned, _DIGITS) % 360.0, np.float64)
    if not crossed:  # mirror images are alike
        phi = np.asarray(np.round(np.minimum(phi, 360.0 - phi), _DIGITS), np.float64)
    return np.asarray(np.round(np.abs(theta), _DIGITS), np.float64), phi


def _of_nearest_directions(
    values: Array, known: NDArray[np.bool_], polar: Array, azimuths: Array
) -> Array:
    """Give nodes (θ, φ) that the list lacks the light of the nearest direction in it."""
    if known.all():
        return values
    theta, phi = np.meshgrid(np.radians(polar), np.radians(azimuths), indexing="ij")
    places = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)], axis=-1)
    nearest = KDTree(places[known]).query(places[~known])[1]
    values = values.copy()
    values[:, ~known] = values[:, known][:, nearest]
    return values


def _filled(
    values: Array, axes: tuple[Array, Array, Array], orders: NDArray[np.int64],
    steps: list[float], index: float,
) -> Array:  # fmt: skip
    """Give orders (λ, θ, φ, m, n) that do not propagate their nearest light in which they do.

    Interpolation between the two sides of a Rayleigh anomaly would halve the light on one side.
    These additions bring the sum of a light to 1 at most, so that sums between lights keep it, too.

    steps : 1e-3 over the optical periods, 1/µm; index : of the medium that the angles belong to.
    """
    lam, theta, phi = np.meshgrid(axes[0], *map(np.radians, axes[1:]), indexing="ij")
    x, y = (-index * np.sin(theta) * part for part in (np.cos(phi), np.sin(phi)))
    places = np.stack([x, y, lam * steps[0]], axis=-1).reshape(-1, 3)
    flat = values.reshape(len(places), len(orders), -1).copy()
    for n in range(len(orders)):
        lit = np.isfinite(flat[:, n, 0])
        if lit.any() and not lit.all():
            nearest = KDTree(places[lit]).query(places[~lit])[1]
            flat[~lit, n] = flat[np.flatnonzero(lit)[nearest], n]
    dark = ~np.isfinite(values[..., :1]).reshape(len(places), -1)
    flat = np.nan_to_num(flat)
    listed, added = ((flat[..., 0] * mask).sum(axis=1, keepdims=True) for mask in (~dark, dark))
    room = np.clip((1.0 - listed) / np.maximum(added, 1e-12), 0.0, 1.0)
    flat *= np.where(dark, room, 1.0)[..., None]
    return flat.reshape(values.shape)


# ---------------------------------------------------------------------- efficiencies of s and p


def imported_table(
    grid: Efficiencies, periods: tuple[float, float], superstrate: float, shown: str,
    header: dict[str, Any],
) -> OrderTable:  # fmt: skip
    """Return the table of a file's efficiencies; its errors are added to the header.

    shown : source of the grid, for messages. Raises a DiffractionError as `read_orders` does.
    """
    ends = float(grid.wavelengths[0]), float(grid.wavelengths[-1])
    thin, crossed = grid.values.shape[-1] == 4, grid.orders.ndim == 2
    if thin and crossed:
        raise DiffractionError(
            f"{shown} has T_s and T_p: tables of crossed gratings hold reflected light alone; "
            "leave these columns out"
        )
    check_outline(periods, ends, superstrate, thin, listed=True)
    orders = grid.orders if crossed else np.column_stack([grid.orders, 0 * grid.orders])
    _check_orders(grid, orders, periods, superstrate, shown)
    values = np.where(np.isnan(grid.values), np.nan, np.maximum(grid.values, 0.0))
    lights = Lights(
        grid.wavelengths, grid.theta, grid.phi, orders, _elements(values, grid, crossed)
    )
    if thin:
        table = _sheet(_response(lights, periods, superstrate), periods, ends, header)
    else:
        table = listed_table(lights, periods, header, superstrate=superstrate)
    warn_of_gaps(table, lights, shown)
    header |= _errors(table, grid, orders, values)
    if header["reciprocity_error"] > _ONE_WAY:
        warn(
            f"light and reversed light differ by {header['reciprocity_error']:.0%} in {shown}, "
            "which no grating does: efficiencies are shares of power, |amplitude|² times the ratio "
            "of cosines; check that, and the signs of the orders and of phi"
        )
    return replace(table, header=header)


def _mirror(theta: Array, phi: Array, crossed: bool) -> tuple[Array, Array]:
    """Return (x, y) of the mirror direction of light; of grooves the image with y at least 0."""
    sine, turn = np.sin(np.radians(theta)), np.radians(phi)
    y = -sine * np.sin(turn)
    return -sine * np.cos(turn), y if crossed else np.abs(y)


def _elements(values: Array, grid: Efficiencies, crossed: bool) -> Array:
    """Return elements (a, b, c, 1, sides, m, 3) of efficiencies (a, b, c, m, 2 or 4)."""
    sides = np.stack(np.split(values, values.shape[-1] // 2, axis=-1), axis=3)
    mean, half = sides.mean(axis=-1), 0.5 * (sides[..., 0] - sides[..., 1])
    # along the normal φ decides what s is
    theta, phi = np.meshgrid(
        np.where(grid.theta == 0.0, MIN_ANGLE, grid.theta), grid.phi, indexing="ij"
    )
    turned = turned_axes(*_mirror(theta, phi, crossed))
    cosine, sine = (part[:, :, None, None] for part in turned)
    elements = np.stack([mean, half * cosine, half * sine], axis=-1)
    for row in np.flatnonzero(grid.theta == 0.0):
        # one light, of which each φ has another s: the elements that fit all of them
        known = np.column_stack([turned.cosine[row], turned.sine[row]])
        fit = np.einsum("kp,lpsm->lsmk", np.linalg.pinv(known, rcond=1e-6), half[:, row])
        level = np.concatenate([mean[:, row].mean(axis=1)[..., None], fit], axis=-1)
        elements[:, row] = level[:, None]
    return elements[:, :, :, None]


def _sheet(
    response: ListedResponse, periods: tuple[float, float], ends: tuple[float, float],
    header: dict[str, Any],
) -> OrderTable:  # fmt: skip
    """Return the table of a thin sheet from its light from above; see `read_orders`.

    response : with both sides' light in the ports of light from above; ends : wavelengths, nm.
    """
    values, count = response.values.astype(np.float64), len(response.orders)
    through = replace(response, values=response.values[..., count:, :])
    alone = OrderTable(periods, ends, through)
    lam, theta, phi = (axis[..., None] for axis in np.meshgrid(*response.axes, indexing="ij"))
    x, y = _mirror(theta, phi, False)
    orders = response.orders[:, 0]
    steps = orders * lam / (1e3 * periods[0])
    # reversed light enters along the order that it left by
    back = alone.efficiency(-x - steps, -y, lam, orders)
    back = np.where(crossed_square(x, y, steps, 0.0) > 0.0, back, values[..., 0, count:, 0])
    reflected = values[..., 0, :count, :]
    left = np.maximum(1.0 - back.sum(axis=-1, keepdims=True), 0.0)
    total = np.maximum(reflected[..., 0].sum(axis=-1, keepdims=True), 1e-12)
    below = reflected * np.minimum(left / total, 1.0)[..., None]
    back = back / np.maximum(back.sum(axis=-1, keepdims=True), 1.0)
    upwards = np.stack([back, 0.0 * back, 0.0 * back], axis=-1)
    from_below = np.concatenate([upwards, below], axis=-2)
    both = np.stack([values[..., 0, :, :], from_below], axis=3).astype(np.float32)
    return OrderTable(periods, ends, replace(response, values=both), header=header, thin=True)


def _check_orders(
    grid: Efficiencies, orders: NDArray[np.int64], periods: tuple[float, float],
    superstrate: float, shown: str,
) -> None:  # fmt: skip
    """Refuse light in evanescent orders, orders that propagate without light, and sums above 1."""
    crossed = grid.orders.ndim == 2
    lam, theta, phi = (
        axis.ravel() for axis in np.meshgrid(grid.wavelengths, grid.theta, grid.phi, indexing="ij")
    )
    x, y = _mirror(theta, phi, crossed)
    steps = [1e-3 * lam / (superstrate * period) for period in periods]

    def square(some: NDArray[np.int64]) -> Array:
        """Return squared cosines (lights, orders)."""
        shifts = (part * step[:, None] for part, step in zip(some.T, steps, strict=True))
        return np.asarray(crossed_square(x[:, None], y[:, None], *shifts))

    names = "the periods, and the signs of the orders, of theta and of phi"
    signs = names if crossed else "the period, and the signs of the orders and of theta"
    values = grid.values.reshape(len(lam), len(orders), -1)
    powers = np.maximum(np.nan_to_num(values), 0.0)
    if len(extra := np.argwhere((powers.max(axis=-1) > ROUNDING) & (square(orders) < -_EDGE))):
        light, place = map(int, extra[0])
        raise DiffractionError(
            f"{shown}, {grid.light(light)}: order {_shown(orders[place], crossed)} does not "
            f"propagate; check {signs}"
        )
    most = [int(np.ceil(2.0 / float(step.min()))) if step.min() > 0.0 else 0 for step in steps]
    every = orders_between([-most[0], -most[1]], most)
    known = {tuple(order): n for n, order in enumerate(orders.tolist())}
    lacking = square(every) > _EDGE
    for column, order in enumerate(map(tuple, every.tolist())):
        if order in known:
            lacking[:, column] &= np.isnan(values[:, known[order]]).any(axis=-1)
    if lacking.any():
        light, place = map(int, np.argwhere(lacking)[0])
        raise DiffractionError(
            f"{shown}, {grid.light(light)}: order {_shown(every[place], crossed)} propagates, and "
            "has no efficiencies; list it, with 0 if it has no light"
        )
    sums = powers.reshape(*powers.shape[:2], -1, 2).sum(axis=(1, 2)).max(axis=-1)
    if sums.max() > LARGEST_SUM:
        raise DiffractionError(
            f"{shown}, {grid.light(int(sums.argmax()))}: the orders sum to {sums.max():.4g}, above "
            f"{LARGEST_SUM}"
        )


def _shown(order: NDArray[np.int64], crossed: bool) -> str:
    return f"({order[0]}, {order[1]})" if crossed else str(order[0])


def warn_of_gaps(table: OrderTable, lights: Lights, shown: str) -> None:
    """Warn of directions that a list lacks."""
    response = table.response
    assert isinstance(response, ListedResponse)
    theta, phi = _canonical(lights, table.crossed)
    bearings = np.unique(phi[theta > 0.0]) if (theta > 0.0).any() else np.zeros(1)
    if table.crossed:
        if np.diff(bearings, append=bearings[0] + 360.0).max() > _WIDEST_GAP:
            warn(
                f"{shown} has no light from some azimuths, which get the efficiencies of the "
                "nearest direction in it; list phi from 0 to 345 in steps of 15"
            )
        return
    sides = {0.0, 180.0} <= set(bearings.tolist())
    if theta.max() < 75.0 or not sides:
        warn(
            f"{shown} has no light from some directions, which get the efficiencies of the nearest "
            "direction in it; list theta from -85 to 85 in steps of 5 or 10 to have all of them"
        )
    elif response.in_plane:
        warn(
            f"{shown} has light across the grooves only (phi = 0): other light gets the same "
            "efficiencies, which is exact for perfect conductors alone"
        )


def _errors(
    table: OrderTable, grid: Efficiencies, orders: NDArray[np.int64], values: Array
) -> dict[str, Any]:
    """Compare a table with its list, per order and polarisation, and light with reversed light.

    Reversed light is compared in all orders but 0, reflected: η_m(ωi) = η_m(−ωo), where the list
    has light as oblique as the reversed light.
    """
    lam, theta, phi = np.meshgrid(grid.wavelengths, grid.theta, grid.phi, indexing="ij")
    level = np.where(theta == 0.0, MIN_ANGLE, theta)
    x, y = (part[..., None] for part in _mirror(level, phi, table.crossed))
    light = x, y, lam[..., None], orders[:, 0], orders[:, 1]
    got = [table.polarised_efficiency(*light)]
    if table.thin:
        got.append(table.polarised_efficiency(*light, transmitted=True))
    truth = np.nan_to_num(values)
    found = np.concatenate(got, axis=-1)
    lit = truth > 1e-9
    relative = np.where(lit, np.abs(found - truth) / np.maximum(truth, 1e-9), 0.0)
    worst = np.unravel_index(int(relative.argmax()), relative.shape)
    missed, total = np.abs(found - truth).sum(axis=(-2, -1)), truth.sum(axis=(-2, -1))
    floor = max(0.05 * float(total.mean()), 1e-12)
    others = (orders != 0).any(axis=1)
    shift = [part * light[2] / (1e3 * period * table.superstrate)
             for part, period in zip(orders.T, table.periods, strict=True)]  # fmt: skip
    out = x + shift[0], y + shift[1]
    known = (np.hypot(*out) <= np.hypot(x, y).max()) & others
    forth = table.efficiency(*light)
    back = np.where(known, table.efficiency(-out[0], -out[1], *light[2:]), forth)
    sent = float(forth[np.broadcast_to(known, forth.shape)].sum())
    return {
        "error_mean": float(missed.sum()) / max(float(total.sum()), 1e-12),
        "error_worst": float(np.quantile(missed / np.maximum(total, floor), 0.95)),
        "error_relative": float(relative.max()),
        "error_place": (
            f"{grid.wavelengths[worst[0]]:g} nm, theta {grid.theta[worst[1]]:g}°, phi "
            f"{grid.phi[worst[2]]:g}°, order {_shown(orders[worst[3]], table.crossed)}, "
            f"{'RT'[worst[4] // 2]}_{'sp'[worst[4] % 2]}"
        ),
        "reciprocity_error": float(np.abs(back - forth).sum()) / max(sent, 1e-12),
    }


def read_orders(
    path: str | os.PathLike[str],
    period: float | tuple[float, float],
    *,
    superstrate: float = 1.0,
) -> OrderTable:
    """Return the table of orders of a file of efficiencies; see `lists`.

    Each listed light has its listed efficiencies of s and of p light; between lights they are
    interpolated linearly. A file with order_x and order_y makes the table of a crossed grating.

    Where the file has light in the plane across the grooves alone (φ = 0), conical light gets the
    efficiencies of the in-plane light with the same orders. That is exact for perfect conductors.
    Directions that the file lacks, all but one perhaps, get the efficiencies of the nearest
    direction in it, order by order. A warning says either.

    With T_s and T_p the table describes a thin sheet. Its transmission from below follows from
    reciprocity, unpolarised; it reflects light from below as light from above, at most the
    remaining power.

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
        periods = period if isinstance(period, tuple) else (period, period)
    elif isinstance(period, tuple):
        raise DiffractionError(
            f"period={period[0]:g},{period[1]:g} µm: {shown} has the orders of grooves, with one "
            "period; crossed gratings have order_x and order_y"
        )
    else:
        periods = period, math.inf
    return imported_table(grid, periods, superstrate, shown, header)
