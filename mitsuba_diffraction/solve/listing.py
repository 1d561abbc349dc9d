"""Efficiencies of a table's orders as the lines of a CSV, which `read_orders` reads back."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..atomic import atomic_path
from ..errors import DiffractionError
from ..tables.orders import OrderTable
from ..tables.orders.lookup import MIN_ANGLE
from .efficiencies import CSV_AXES, REFLECTED, TRANSMITTED, check_light
from .stations import Real

#: Lines at most: what `efficiencies` reads.
_MOST_LINES = 2_000_000
#: Distance from grazing, in direction cosines, within which an order is not listed.
_EDGE = 1e-7


class Listing(NamedTuple):
    """Lines of efficiencies.

    Attributes
    ----------
    columns : names of the numbers: wavelength, θ, φ, order, then shares of s and of p light.
    rows : (n, 6), or (n, 8) of a thin sheet.
    """

    columns: tuple[str, ...]
    rows: Real

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV; numbers have 7 digits.

        Raises a DiffractionError if the file cannot be written; no half-written file is left.
        """
        shares = ["%.7g"] * (len(self.columns) - 4)
        with atomic_path(Path(path)) as temporary:
            np.savetxt(
                temporary, self.rows, ["%.9g", "%.9g", "%.9g", "%d", *shares], ",",
                header=",".join(self.columns), comments="", encoding="utf-8",
            )  # fmt: skip


def list_orders(
    table: OrderTable,
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
    most = int(np.ceil(2e3 * table.optical_period / lights[0][0]))
    count = np.prod([len(axis) for axis in lights], dtype=float) * (most + 1)
    if count > _MOST_LINES:
        raise DiffractionError(
            f"these wavelengths and angles make {count:.2g} lines, {_MOST_LINES} are allowed; "
            "choose fewer"
        )
    orders = np.arange(-most, most + 1)
    lam, polar, azimuth, m = (
        axis.ravel() for axis in np.meshgrid(*lights, orders, indexing="ij", copy=False)
    )
    # at the normal, φ alone says which way s is
    sine = np.sin(np.radians(np.where(polar == 0.0, MIN_ANGLE, polar)))
    x, y = -sine * np.cos(np.radians(azimuth)), sine * np.sin(np.radians(azimuth))
    leaves = np.abs(x + m * lam / (1e3 * table.optical_period)) < np.sqrt(1 - y**2) - _EDGE
    lam, polar, azimuth, m, x, y = (part[leaves] for part in (lam, polar, azimuth, m, x, y))
    shares = [_shares(table, x, y, lam, m, polarised, False)]
    if table.thin:
        shares.append(_shares(table, x, y, lam, m, polarised, True))
    kinds = REFLECTED + (TRANSMITTED if table.thin else ())
    rows = np.column_stack([lam, polar, azimuth, m, *shares])
    return Listing((*CSV_AXES, *kinds), rows)


def _shares(
    table: OrderTable,
    x: Real,
    y: Real,
    wavelength: Real,
    order: NDArray[np.int64],
    polarised: bool,
    transmitted: bool,
) -> Real:
    """Return the shares (n, 2) of s and p light, or of unpolarised light twice."""
    lookup = table.polarised_efficiency if polarised else table.efficiency
    values = lookup(x, y, wavelength, order, transmitted=transmitted)
    return np.asarray(values if polarised else np.repeat(values[:, None], 2, axis=1))
