"""Lights of a file or a solution: checks of their orders, interpolation, errors of a table."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.spatial import QhullError

from ..errors import DiffractionError, warn
from ..tables.orders.table import LARGEST_SUM
from .efficiencies import ROUNDING, Efficiencies
from .stations import Real

#: Difference between light and reversed light above which a file hardly holds powers: grids of 5 to
#: 45° have 0.02 to 0.14, efficiencies without the ratio of cosines 0.4 to 0.8.
_ONE_WAY = 0.2


def interpolated(points: Real, values: Real, places: Real) -> Real:
    """Interpolate values (n, …) at points (n, axes) linearly; use the nearest value outside."""
    flat = values.reshape(len(values), -1)
    result = NearestNDInterpolator(points, flat)(places)
    with contextlib.suppress(QhullError):  # too few points, or all on a line
        linear = LinearNDInterpolator(points, flat)(places)
        result = np.where(np.isnan(linear), result, linear)
    return np.asarray(result).reshape(*places.shape[:-1], *values.shape[1:])


def check_orders(
    grid: Efficiencies, values: Real, every: NDArray[np.int64],
    propagates: Callable[[NDArray[np.int64], float], NDArray[np.bool_]], signs: str, shown: str,
) -> None:  # fmt: skip
    """Refuse light in evanescent orders, orders that propagate without light, and sums above 1.001.

    Parameters
    ----------
    values : (n, m, kinds, polarisations) of all lights and orders of the grid.
    every : (k,), or (k, 2) of a crossed grating, orders that some light may have.
    propagates : returns whether orders propagate, (n, orders); at grazing, where rounding decides,
        they do for 1, and do not for -1.
    signs : numbers of the user that may be wrong.
    """
    powers = np.maximum(np.nan_to_num(values), 0.0)
    dark = ~propagates(grid.orders, 1.0)
    if len(extra := np.argwhere((powers.max(axis=(2, 3)) > ROUNDING) & dark)):
        light, place = map(int, extra[0])
        raise DiffractionError(
            f"{shown}, {grid.light(light)}: order {_order_text(grid.orders[place])} does not "
            f"propagate; check {signs}"
        )
    listed = {_order_text(order): ~np.isnan(part).any(axis=(1, 2))
              for order, part in zip(grid.orders, values.swapaxes(0, 1), strict=True)}  # fmt: skip
    lacking = propagates(every, -1.0)
    for column, order in zip(lacking.T, every, strict=True):
        column &= ~listed.get(_order_text(order), np.False_)
    if lacking.any():
        light, place = map(int, np.argwhere(lacking)[0])
        raise DiffractionError(
            f"{shown}, {grid.light(light)}: order {_order_text(every[place])} propagates, and has "
            "no efficiencies; list it, with 0 if it has no light"
        )
    sums = powers.sum(axis=(1, 2)).max(axis=-1)
    if sums.max() > LARGEST_SUM:
        raise DiffractionError(
            f"{shown}, {grid.light(int(sums.argmax()))}: the orders sum to {sums.max():.4g}, above "
            f"{LARGEST_SUM}"
        )


def _order_text(order: Any) -> str:
    """Return an order, or a pair of a crossed grating, for people."""
    return f"({order[0]}, {order[1]})" if np.ndim(order) else str(order)


def missed_shares(missed: Real, light: Real) -> tuple[float, float]:
    """Return the missed part of all light, and the part that 95 % of the lights (n,) keep.

    Directions with hardly any light are judged by a twentieth of the mean.
    """
    floor = max(0.05 * float(light.mean()), 1e-12)
    worst = np.quantile(missed / np.maximum(light, floor), 0.95)
    return float(missed.sum()) / max(float(light.sum()), 1e-12), float(worst)


def warn_of_one_way(error: float, shown: str) -> None:
    """Warn of light without reciprocity.

    error : difference between light and reversed light, as a share of the orders but 0.
    """
    if error > _ONE_WAY:
        warn(
            f"light and reversed light differ by {error:.0%} in {shown}, which no grating does: "
            "efficiencies are shares of power, |amplitude|² times the ratio of cosines; check "
            "that, and the signs of the orders and of phi"
        )
