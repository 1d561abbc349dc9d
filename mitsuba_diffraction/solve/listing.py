"""Efficiencies of a table's orders as the lines of a CSV, which `read_orders` reads back."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..atomic import atomic_path
from ..errors import DiffractionError
from ..tables.orders import CrossedTable, OrderTable
from ..tables.orders.crossed import propagates
from ..tables.orders.lookup import MIN_ANGLE
from .efficiencies import CSV_AXES, PAIR, REFLECTED, TRANSMITTED, check_light
from .stations import Real

#: Lines at most: what `efficiencies` reads.
_MOST_LINES = 2_000_000
#: Distance from grazing, in direction cosines, within which an order is not listed.
_EDGE = 1e-7


class Listing(NamedTuple):
    """Lines of efficiencies.

    Attributes
    ----------
    columns : names of the numbers: wavelength, θ, φ, order (of a crossed grating two), then shares
        of s and of p light.
    rows : (n, 6), or (n, 8) of a thin sheet, (n, 7) of a crossed grating.
    """

    columns: tuple[str, ...]
    rows: Real

    @property
    def orders(self) -> str:
        """First and last order, for people."""
        ends = (self.rows[:, 3], self.rows[:, 4]) if PAIR[0] in self.columns else (self.rows[:, 3],)
        low, high = (", ".join(f"{f(part):.0f}" for part in ends) for f in (np.min, np.max))
        return f"orders ({low}) to ({high})" if len(ends) > 1 else f"orders {low} to {high}"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV; numbers have 7 digits.

        Raises a DiffractionError if the file cannot be written; no half-written file is left.
        """
        numbers = ["%d" if name.startswith("order") else "%.7g" for name in self.columns[3:]]
        with atomic_path(Path(path)) as temporary:
            np.savetxt(
                temporary, self.rows, ["%.9g", "%.9g", "%.9g", *numbers], ",",
                header=",".join(self.columns), comments="", encoding="utf-8",
            )  # fmt: skip


def list_orders(
    table: OrderTable | CrossedTable,
    wavelengths: ArrayLike,
    theta: ArrayLike,
    phi: ArrayLike = 0.0,
    *,
    polarised: bool = False,
) -> Listing:
    """List the efficiencies of all propagating orders, with the conventions of `efficiencies`.

    Raises a DiffractionError if an angle or wavelength is out of its range, there are over two
    million lines, the table is of a block, or it has no s and p of conical light
    (`OrderTable.polarised_efficiency`).

    Parameters
    ----------
    wavelengths : in vacuum, nm, within the table's.
    theta, phi : direction to the light, degrees, within the superstrate: from the normal, and from
        x towards y.
    polarised : whether R_s and R_p hold s and p light; otherwise both are the share of
        unpolarised light.
    """
    if table.block:
        raise DiffractionError(
            "orders of blocks have directions on two sides, which lines of R and T have not; take "
            "OrderTable.efficiency"
        )
    lights = [np.unique(np.asarray(values, np.float64)) for values in (wavelengths, theta, phi)]
    low, high = table.wavelengths
    check_light(lights[0], lights[1], lights[2], "orders")
    if lights[0][0] < low * (1 - 1e-9) or lights[0][-1] > high * (1 + 1e-9):
        raise DiffractionError(
            f"wavelengths from {lights[0][0]:g} to {lights[0][-1]:g} nm: the table has {low:g} to "
            f"{high:g} nm"
        )
    if isinstance(table, CrossedTable):
        return _crossed(table, lights, polarised)
    most = int(np.ceil(2e3 * table.optical_period / lights[0][0]))
    _check_count(lights, most + 1)
    orders = np.arange(-most, most + 1)
    lam, polar, azimuth, m = (
        axis.ravel() for axis in np.meshgrid(*lights, orders, indexing="ij", copy=False)
    )
    x, y = _mirror(polar, azimuth)
    leaves = np.abs(x + m * lam / (1e3 * table.optical_period)) < np.sqrt(1 - y**2) - _EDGE
    lam, polar, azimuth, m, x, y = (part[leaves] for part in (lam, polar, azimuth, m, x, y))
    lookup = table.polarised_efficiency if polarised else table.efficiency
    kinds = REFLECTED + (TRANSMITTED if table.thin else ())
    shares = [lookup(x, y, lam, m, transmitted=kind == TRANSMITTED[0]) for kind in kinds[::2]]
    if not polarised:
        shares = [np.repeat(values[:, None], 2, axis=1) for values in shares]
    rows = np.column_stack([lam, polar, azimuth, m, *shares])
    return Listing((*CSV_AXES, *kinds), rows)


def _crossed(table: CrossedTable, lights: list[Real], polarised: bool) -> Listing:
    """List the orders of a crossed grating."""
    if polarised:
        raise DiffractionError(
            "tables of crossed gratings have shares of unpolarised light; leave polarised out"
        )
    m_x, m_y = table.last_orders
    _check_count(lights, (2 * m_x + 1) * (2 * m_y + 1))
    pairs = np.arange(-m_x, m_x + 1), np.arange(-m_y, m_y + 1)
    lam, polar, azimuth, m, n = (
        axis.ravel().astype(np.float64) for axis in np.meshgrid(*lights, *pairs, indexing="ij")
    )
    x, y = _mirror(polar, azimuth)
    y = -y  # mirror images of crossed gratings differ
    leaves = propagates(x, y, lam, m, n, table.periods)
    rows = [part[leaves] for part in (lam, polar, azimuth, m, n)]
    shares = table.efficiency(x[leaves], y[leaves], rows[0], rows[3], rows[4])
    return Listing((*CSV_AXES[:3], *PAIR, *REFLECTED), np.column_stack([*rows, shares, shares]))


def _mirror(polar: Any, azimuth: Any) -> tuple[Real, Real]:
    """Return (x, y) of the mirror direction of light on grooves, y mirrored.

    At the normal, φ decides what s is.
    """
    sine = np.sin(np.radians(np.where(polar == 0.0, MIN_ANGLE, polar)))
    return -sine * np.cos(np.radians(azimuth)), sine * np.sin(np.radians(azimuth))


def _check_count(lights: list[Real], orders: int) -> None:
    """Refuse more lines than can be read again."""
    count = np.prod([len(axis) for axis in lights], dtype=float) * orders
    if count > _MOST_LINES:
        raise DiffractionError(
            f"these wavelengths and angles make {count:.2g} lines, {_MOST_LINES} are allowed; "
            "choose fewer"
        )
