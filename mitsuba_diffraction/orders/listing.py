"""Efficiencies and Jones matrices of a table's orders as lines of a CSV, or as NetCDF.

`read_orders` reads efficiencies back.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.io import netcdf_file

from ..arrays import Real
from ..atomic import atomic_path
from ..columns import save_rows
from ..errors import DiffractionError
from ..optics.orders import crossed_square
from .efficiency import jones_matrices
from .file import add_variable
from .listed import mirror_of, warn_of_other_directions
from .lists import CSV_AXES, PAIR, REFLECTED, TRANSMITTED, axes_of, check_light
from .polarised import MIN_ANGLE
from .response import ListedResponse, orders_between
from .table import OrderTable

#: Columns of Jones matrices: real and imaginary part, named by leaving and incident polarisation.
JONES = tuple(f"J_{pair}_{part}" for pair in ("ss", "sp", "ps", "pp") for part in ("re", "im"))
#: Column of 1 where Jones matrices have the phase of the order, 0 where J_ss is made real.
WITH_PHASE = "has_phase"
#: Lines at most: what `efficiencies` reads.
_MOST_LINES = 2_000_000
#: Squared cosine of an order below which it is not listed: rounding.
_EDGE = 1e-9


class Listing(NamedTuple):
    """Lines of efficiencies.

    Attributes
    ----------
    columns : names of the numbers: wavelength, θ, φ, order (of a crossed grating two), then shares
        of s and of p light, or the elements of Jones matrices, `JONES`, and `WITH_PHASE`.
    rows : (n, columns), a line for each order that propagates.
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
        """Write a CSV, whose numbers have 7 digits, or NetCDF (.nc), as `lists` has them.

        Raises a DiffractionError if the file cannot be written; no half-written file is left.
        """
        if Path(path).suffix == ".nc":
            self._save_netcdf(Path(path))
            return
        digits = [9, 9, 9, *[7] * (len(self.columns) - 3)]
        save_rows(Path(path), self.columns, self.rows + 0.0, digits)  # no order -0

    def _save_netcdf(self, path: Path) -> None:
        """Write the numbers over wavelength, theta, phi and order; NaN where none propagates."""
        names = axes_of(self.columns)
        lights, numbers = self.rows.T[: len(names)], self.rows.T[len(names) :]
        axes, places = zip(
            *(np.unique(column, return_inverse=True) for column in lights), strict=True
        )
        with atomic_path(path) as temporary, netcdf_file(str(temporary), "w") as file:
            units = "nm", "degrees", "degrees", "1", "1"
            for name, unit, along in zip(names, units, axes, strict=False):
                add_variable(file, name, (name,), along, unit)
            for name, column in zip(self.columns[len(names) :], numbers, strict=True):
                values = np.full([len(along) for along in axes], np.nan)
                values[places] = column
                add_variable(file, name, names, values)


def list_orders(
    table: OrderTable,
    wavelengths: ArrayLike,
    theta: ArrayLike,
    phi: ArrayLike = 0.0,
    *,
    polarised: bool = False,
    from_below: bool = False,
    jones: bool = False,
) -> Listing:
    """List the efficiencies of all propagating orders, with the conventions of `lists`.

    Raises a DiffractionError if an angle or wavelength is out of its range, there are over two
    million lines, or the table has no s and p of conical light
    (`OrderTable.polarised_efficiency`). Warns of light outside the directions of a list.

    Parameters
    ----------
    wavelengths : in vacuum, nm, within the table's.
    theta, phi : direction to the light, degrees, within the medium that it comes from: from the
        normal, and from x towards y.
    polarised : whether R_s and R_p hold s and p light; otherwise both are the share of
        unpolarised light.
    from_below : whether the light comes from below a thin sheet, or from within a block.
    jones : Jones matrices (`efficiency.jones_matrices`) in place of efficiencies, J_ps from s to p
        light.
    """
    lights = [np.unique(np.asarray(values, np.float64)) for values in (wavelengths, theta, phi)]
    low, high = table.wavelengths
    check_light(lights[0], lights[1], lights[2], "orders")
    if lights[0][0] < low * (1 - 1e-9) or lights[0][-1] > high * (1 + 1e-9):
        raise DiffractionError(
            f"wavelengths from {lights[0][0]:g} to {lights[0][-1]:g} nm: the table has {low:g} to "
            f"{high:g} nm"
        )
    warn_of_other_directions(table, lights[1], lights[2])
    orders = orders_of(table, lights[0][0])
    count = np.prod([len(axis) for axis in lights], dtype=float) * len(orders)
    if count > _MOST_LINES:  # more than can be read again
        raise DiffractionError(
            f"these wavelengths and angles make {count:.2g} lines, {_MOST_LINES} are allowed; "
            "choose fewer"
        )
    lam, polar, azimuth, n = (
        axis.ravel() for axis in np.meshgrid(*lights, np.arange(len(orders)), indexing="ij")
    )
    m_x, m_y = orders[n].T
    index = (table.block or 1.0) if from_below else 1.0
    steps = (1e-3 * lam / (period * table.superstrate) for period in table.periods)
    shifts = (m * step for m, step in zip((m_x, m_y), steps, strict=True))
    square = crossed_square(*(index * part for part in mirror_of(polar, azimuth)), *shifts)
    # at the normal, φ decides what s is
    level = np.where(polar == 0.0, MIN_ANGLE, polar)
    x, y = (index * part for part in mirror_of(level, azimuth))
    # of a block, orders within it are more
    leaves = square + (table.block or 1.0) ** 2 - 1.0 > _EDGE
    parts = (lam, polar, azimuth, m_x, m_y, x, y)
    lam, polar, azimuth, m_x, m_y, x, y = (part[leaves] for part in parts)
    numbers = [m_x, m_y] if table.crossed else [m_x]
    axes = (*CSV_AXES[:3], *(PAIR if table.crossed else CSV_AXES[3:]))
    if jones:
        matrices, with_phase = jones_matrices(table, x, y, lam, m_x, m_y)
        entries = matrices.reshape(-1, 4).T
        shares = [part for entry in entries for part in (entry.real, entry.imag)]
        return Listing(
            (*axes, *JONES, WITH_PHASE),
            np.column_stack([lam, polar, azimuth, *numbers, *shares, with_phase]),
        )
    lookup = table.polarised_efficiency if polarised else table.efficiency
    kinds = REFLECTED + (TRANSMITTED if table.sides == 2 else ())
    below = {"from_below": True} if from_below else {}
    shares = [
        lookup(x, y, lam, m_x, m_y, transmitted=kind == TRANSMITTED[0], **below)
        for kind in kinds[::2]
    ]
    if not polarised:
        shares = [np.repeat(values[:, None], 2, axis=1) for values in shares]
    return Listing((*axes, *kinds), np.column_stack([lam, polar, azimuth, *numbers, *shares]))


def orders_of(table: OrderTable, shortest: float) -> NDArray[np.int64]:
    """Return all orders (m, 2) that may propagate from some wavelength on, nm."""
    if isinstance(table.response, ListedResponse):
        return table.response.orders
    most = int(np.ceil(2e3 * table.optical_period / shortest))
    return orders_between((-most, 0), (most, 0))
