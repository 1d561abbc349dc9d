"""Table of the orders of a crossed grating, which repeats along x and along y."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...errors import DiffractionError
from ...optics.orders import crossed_square, wavelength_coordinate
from .cells import Array
from .table import LARGEST_SUM, PERIODS, check_wavelengths, reach_of

#: Nodes along each axis of the directions, and along wavelengths at most.
NODES, MOST_WAVELENGTHS = 25, 64


class Records(NamedTuple):
    """Efficiencies at the corners of cells, for one gather of 8 numbers.

    Attributes
    ----------
    cells : numbers of cells along wavelength, y and x.
    values : (cells × (orders + 1), 8) float16: the orders of a cell, m_y outermost, then their sum.
    """

    cells: tuple[int, ...]
    values: NDArray[np.float16]


@dataclass(frozen=True, eq=False, repr=False)
class CrossedTable:
    """Efficiencies of a crossed grating's orders for unpolarised light, on an even grid.

    Between nodes they are interpolated linearly, along wavelength and along the tangential
    components x and y of the mirror direction of the incident light. Order (m_x, m_y) leaves at
    x + m_x λ/d_x, y + m_y λ/d_y.

    Raises a DiffractionError if the shape does not fit, or numbers are negative, not finite, or sum
    over orders to above 1.001.

    Attributes
    ----------
    periods : d_x and d_y, µm.
    wavelengths : shortest and longest, in vacuum, nm; light beyond them as in `OrderTable`.
    values : (λ, y, x, m_y, m_x) float32, at wavelengths even between `wavelengths`, two at least,
        and x and y even from −1 to 1; of orders from −`most_orders` to `most_orders`. Nodes have
        efficiencies of orders that do not propagate there, from nearby light, for interpolation.
    header : as of `OrderTable`.
    """

    periods: tuple[float, float]
    wavelengths: tuple[float, float]
    values: NDArray[np.float32]
    header: Mapping[str, Any] = field(default_factory=dict)

    # features of an OrderTable that these tables lack
    superstrate: ClassVar[float] = 1.0
    thin: ClassVar[bool] = False
    block: ClassVar[float | None] = None
    sides: ClassVar[int] = 1
    polarised: ClassVar[bool] = False

    # Set by the package, since files build on this class
    load: ClassVar[Callable[..., CrossedTable]]  #: from a file: `file.load_crossed`
    save: ClassVar[Callable[..., None]]  #: to a file: `file.save_crossed`

    def __post_init__(self) -> None:
        m_x, m_y = most_orders(self.periods, self.wavelengths)
        shape = self.values.shape
        expected = (NODES, NODES, 2 * m_y + 1, 2 * m_x + 1)
        if len(shape) != 5 or not 2 <= shape[0] <= MOST_WAVELENGTHS or shape[1:] != expected:
            raise DiffractionError(
                f"efficiencies of shape {shape}; expected 2 to {MOST_WAVELENGTHS} wavelengths, "
                f"then {expected}"
            )
        if not np.isfinite(self.values).all() or self.values.min() < 0.0:
            raise DiffractionError("efficiencies must be finite and at least 0")
        if (largest := float(self.values.sum(axis=(3, 4)).max())) > LARGEST_SUM:
            raise DiffractionError(f"efficiencies sum to {largest:.4g}, above {LARGEST_SUM}")

    @property
    def period(self) -> float:
        """The longer period, µm."""
        return max(self.periods)

    @property
    def reach(self) -> tuple[float, float]:
        """Wavelengths between which light has efficiencies, nm."""
        return reach_of(self.wavelengths)

    @property
    def last_orders(self) -> tuple[int, int]:
        """Largest order along x and along y."""
        return most_orders(self.periods, self.wavelengths)

    @property
    def layout(self) -> str:
        """Size of the grid, for people."""
        m_x, m_y = self.last_orders
        return (
            f"{NODES} x {NODES} directions, {len(self.values)} wavelengths, orders to "
            f"({m_x}, {m_y})"
        )

    @property
    def nbytes(self) -> int:
        """Size of the numbers in memory."""
        return self.values.nbytes

    def efficiency(
        self,
        x: ArrayLike,
        y: ArrayLike,
        wavelength: ArrayLike,
        order_x: ArrayLike,
        order_y: ArrayLike,
    ) -> Array:
        """Return the efficiency of orders, of any shape; 0 where an order does not propagate.

        x, y : direction cosines of the mirror direction of the incident light, −(ωi)_x, −(ωi)_y.
        wavelength : in vacuum, nm; light beyond `reach` has none.
        """
        x, y, lam, m, n = np.broadcast_arrays(
            *(np.asarray(part, np.float64) for part in (x, y, wavelength, order_x, order_y))
        )
        share = wavelength_coordinate(lam, *self.wavelengths, 1e-3)
        places = [
            share * (len(self.values) - 1),
            *(0.5 * (at + 1.0) * (NODES - 1) for at in (y, x)),
        ]
        m_x, m_y = self.last_orders
        lit = (lam >= self.reach[0]) & (lam <= self.reach[1]) & (np.abs(m) <= m_x)
        lit &= (np.abs(n) <= m_y) & propagates(x, y, lam, m, n, self.periods)
        orders = np.where(lit, n, 0.0) + m_y, np.where(lit, m, 0.0) + m_x
        at = np.stack([*places, *orders]).reshape(5, -1)
        found = scipy.ndimage.map_coordinates(self.values, at, np.float64, 1, mode="nearest")
        return np.where(lit, found.reshape(x.shape), 0.0)

    def records(self) -> Records:
        """Return the table as a kernel reads it."""
        values = self.values.reshape(*self.values.shape[:3], -1)
        return Records(tuple(n - 1 for n in values.shape[:3]), corner_records(values))

    def digest(self) -> str:
        """SHA-256 of all that look-ups depend on; not of the header."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        outline = json.dumps([self.periods, self.wavelengths, self.values.shape])
        content = hashlib.sha256(outline.encode())
        content.update(np.ascontiguousarray(self.values).data)
        return content.hexdigest()

    def summary(self) -> dict[str, Any]:
        """Plain numbers and strings for people and for JSON."""
        return {
            "periods_um": list(self.periods),
            "wavelength_range_nm": list(self.wavelengths),
            "grid": self.layout,
            "memory_mb": round(self.nbytes / 1e6, 2),
            **self.header,
        }

    def __repr__(self) -> str:
        (d_x, d_y), (low, high) = self.periods, self.wavelengths
        size = f"{self.nbytes / 1e6:.1f} MB"
        return f"CrossedTable({d_x:g} x {d_y:g} µm, {low:g}–{high:g} nm, {size})"


def most_orders(periods: tuple[float, float], wavelengths: tuple[float, float]) -> tuple[int, int]:
    """Return the largest order along x and along y that propagates from any direction.

    Raises a DiffractionError for periods or wavelengths out of range.
    """
    low, _ = check_wavelengths(wavelengths)
    # a record of all orders, at all nodes, has to fit
    longest = min(PERIODS[1], 4e-3 * low)
    if not all(PERIODS[0] <= period <= longest for period in periods):  # also refuses NaN
        raise DiffractionError(
            f"periods={periods[0]:g}, {periods[1]:g} µm must be {PERIODS[0]:g} to {longest:.3g} "
            f"µm, four times the shortest wavelength, {low:g} nm"
        )
    return int(2e3 * periods[0] / low), int(2e3 * periods[1] / low)


def all_orders(last: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return m_x and m_y of all orders of a table, (m_y, m_x) each, as `values` has them."""
    m_y, m_x = np.mgrid[-last[1] : last[1] + 1, -last[0] : last[0] + 1]
    return m_x, m_y


def propagates(
    x: Array, y: Array, wavelength: Array, order_x: Array, order_y: Array,
    periods: tuple[float, float],
) -> NDArray[np.bool_]:  # fmt: skip
    """Whether orders propagate, by the grating equation; arguments as of `efficiency`."""
    steps = (1e-3 * np.asarray(wavelength) / period for period in periods)
    shift_x, shift_y = (m * step for m, step in zip((order_x, order_y), steps, strict=True))
    return np.asarray(crossed_square(x, y, shift_x, shift_y) > 0.0)


def corner_records(values: Array | NDArray[np.float32]) -> NDArray[np.float16]:
    """Return efficiencies (…, orders), then their sum, at the corners of all cells, (n, 8).

    Cells lie along the first three axes; corners are 000, 001, 010 … 111.
    """
    whole = np.concatenate([values, values.sum(axis=-1, keepdims=True)], axis=-1)
    pairs = itertools.product((slice(-1), slice(1, None)), repeat=3)
    return np.stack([whole.astype(np.float16)[pair] for pair in pairs], axis=-1).reshape(-1, 8)
