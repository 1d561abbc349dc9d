"""`read_orders`: the table of a file of efficiencies of s and p, as of another program or a bench.

Lights of s and p become elements of Mueller matrices about the axes of the grooves
(`polarised`), which have no special place at the normal: M₀₁ = ½(η_s − η_p) cos 2ψ and
M₀₂ = ½(η_s − η_p) sin 2ψ, with ψ from the axis e to that of s (`polarised.turned_axes`).
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Real
from ..errors import DiffractionError, warn
from ..optics.orders import crossed_square
from .listed import Lights, listed_response, mirror_of, warn_of_gaps
from .lists import ROUNDING, read_efficiencies
from .polarised import MIN_ANGLE, turned_axes
from .response import LARGEST_SUM, ListedResponse, canonical, orders_between
from .table import OrderTable, check_outline
from .table_error import table_error

#: Difference between light and reversed light above which a file hardly holds powers: grids of 5 to
#: 45° have 0.02 to 0.14, efficiencies without the ratio of cosines 0.4 to 0.8.
_ONE_WAY = 0.2
#: Distance from grazing, in squared cosines, within which rounding decides whether an order
#: propagates.
_EDGE = 1e-6
#: Largest difference of efficiencies that are listed twice: measurements repeat within it.
_REPEATED = 1e-3
#: Efficiency from which on relative errors are measured.
_COUNTED = 1e-9


def _placed(theta: Real, phi: Real, crossed: bool) -> tuple[Real, Real]:
    """Return the mirror direction of light; of grooves the image with y at least 0."""
    x, y = mirror_of(theta, phi)
    return x, y if crossed else np.abs(y)


def _elements(values: Real, grid: Lights, crossed: bool) -> Real:
    """Return elements (a, b, c, 1, sides, m, 3) of efficiencies (a, b, c, m, 2 or 4)."""
    sides = np.stack(np.split(values, values.shape[-1] // 2, axis=-1), axis=3)
    mean, half = sides.mean(axis=-1), 0.5 * (sides[..., 0] - sides[..., 1])
    # along the normal φ decides what s is
    theta, phi = np.meshgrid(
        np.where(grid.theta == 0.0, MIN_ANGLE, grid.theta), grid.phi, indexing="ij"
    )
    turned = turned_axes(*_placed(theta, phi, crossed))
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
    x, y = _placed(theta, phi, False)
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
    grid: Lights, periods: tuple[float, float], superstrate: float, shown: str
) -> None:
    """Refuse light in evanescent orders, orders that propagate without light, and sums above 1."""
    crossed, orders = grid.crossed, grid.orders
    lam, theta, phi = (
        axis.ravel() for axis in np.meshgrid(grid.wavelengths, grid.theta, grid.phi, indexing="ij")
    )
    x, y = _placed(theta, phi, crossed)
    steps = [1e-3 * lam / (superstrate * period) for period in periods]

    def square(some: NDArray[np.int64]) -> Real:
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
            f"{shown}, {grid.light(light)}: order {grid.order(place)} does not "
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
        order = tuple(every[place].tolist())
        raise DiffractionError(
            f"{shown}, {grid.light(light)}: order {order if crossed else order[0]} propagates, and "
            "has no efficiencies; list it, with 0 if it has no light"
        )
    sums = powers.reshape(*powers.shape[:2], -1, 2).sum(axis=(1, 2)).max(axis=-1)
    if sums.max() > LARGEST_SUM:
        raise DiffractionError(
            f"{shown}, {grid.light(int(sums.argmax()))}: the orders sum to {sums.max():.4g}, above "
            f"{LARGEST_SUM}"
        )


def _check_repeated(grid: Lights, shown: str) -> None:
    """Refuse a direction that is there in other words with other efficiencies."""
    theta, phi = (part.ravel() for part in canonical(grid.theta, grid.phi, True))
    names = np.stack(np.meshgrid(grid.theta, grid.phi, indexing="ij"), axis=-1).reshape(-1, 2)
    values = np.nan_to_num(grid.values).reshape(len(grid.wavelengths), len(theta), -1)
    first: dict[tuple[float, float], int] = {}
    for n in np.flatnonzero(theta > 0.0).tolist():  # along the normal φ says what s is
        before = first.setdefault((theta[n], phi[n]), n)
        if np.abs(values[:, n] - values[:, before]).max() > _REPEATED:
            (t, p), (same_t, same_p) = names[n], names[before]
            raise DiffractionError(
                f"{shown}: theta {t:g}°, phi {p:g}° is the direction of theta {same_t:g}°, phi "
                f"{same_p:g}°, with other efficiencies; list it once"
            )


def _errors(table: OrderTable, grid: Lights, values: Real) -> dict[str, Any]:
    """Compare a table with its list, per order and polarisation, and light with reversed light.

    Reversed light is compared in all orders but 0, reflected: η_m(ωi) = η_m(−ωo), where the list
    has light as oblique as the reversed light.
    """
    lam, theta, phi = np.meshgrid(grid.wavelengths, grid.theta, grid.phi, indexing="ij")
    level = np.where(theta == 0.0, MIN_ANGLE, theta)
    x, y = (part[..., None] for part in _placed(level, phi, table.crossed))
    orders = grid.orders
    light = x, y, lam[..., None], *orders.T
    got = [table.polarised_efficiency(*light)]
    if table.thin:
        got.append(table.polarised_efficiency(*light, transmitted=True))
    truth = np.nan_to_num(values)
    found = np.concatenate(got, axis=-1)
    shape = (-1, len(orders), truth.shape[-1])
    every = np.ones(truth.size // truth.shape[-1], bool).reshape(-1, len(orders))

    def place(light: int, order: int, kind: int) -> str:
        return f"{grid.light(light)}, order {grid.order(order)}, {'RT'[kind // 2]}_{'sp'[kind % 2]}"

    error = table_error(found.reshape(shape), truth.reshape(shape), every, _COUNTED, place)
    others = (orders != 0).any(axis=1)
    shift = [part * light[2] / (1e3 * period * table.superstrate)
             for part, period in zip(orders.T, table.periods, strict=True)]  # fmt: skip
    out = x + shift[0], y + shift[1]
    known = (np.hypot(*out) <= np.hypot(x, y).max()) & others
    # `efficiency` may be that of reversed light already
    forth = got[0].mean(axis=-1)
    reversed_ = table.polarised_efficiency(-out[0], -out[1], *light[2:])
    back = np.where(known, reversed_.mean(axis=-1), forth)
    sent = float(forth[np.broadcast_to(known, forth.shape)].sum())
    reciprocity = float(np.abs(back - forth).sum()) / max(sent, 1e-12)
    return {**error.facts(), "reciprocity_error": reciprocity}


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
    if grid.crossed:
        periods = period if isinstance(period, tuple) else (period, period)
    elif isinstance(period, tuple):
        raise DiffractionError(
            f"period={period[0]:g},{period[1]:g} µm: {shown} has the orders of grooves, with one "
            "period; crossed gratings have order_x and order_y"
        )
    else:
        periods = period, math.inf
    ends = float(grid.wavelengths[0]), float(grid.wavelengths[-1])
    thin, crossed = grid.values.shape[-1] == 4, grid.crossed
    if thin and crossed:
        raise DiffractionError(
            f"{shown} has T_s and T_p: tables of crossed gratings hold reflected light alone; "
            "leave these columns out"
        )
    check_outline(periods, ends, superstrate, thin, listed=True)
    _check_orders(grid, periods, superstrate, shown)
    _check_repeated(grid, shown)
    values = np.where(np.isnan(grid.values), np.nan, np.maximum(grid.values, 0.0))
    lights = grid._replace(values=_elements(values, grid, crossed))
    response = listed_response(lights, periods, superstrate)
    if thin:
        table = _sheet(response, periods, ends, header)
    else:
        table = OrderTable(periods, ends, response, superstrate, header)
    warn_of_gaps(table, shown)
    header |= _errors(table, grid, values)
    if header["reciprocity_error"] > _ONE_WAY:
        warn(
            f"light and reversed light differ by {header['reciprocity_error']:.0%} in {shown}, "
            "which no grating does: efficiencies are shares of power, |amplitude|² times the ratio "
            "of cosines; check that, and the signs of the orders and of phi"
        )
    return replace(table, header=header)
