"""Gratings: orders on one line, and the directions that light goes to and fro between (NumPy only).

With x along the line and y across, light from ωi goes to x = m g − xi, y = −yi, g = λ/period, and
from there to xi + m'g. A grating mirrors y, so c = √(1 − y²) is one for all of them, and of a
finite chain of directions each half sends its light to the other half. Orders appear and vanish
at x = ±c, so all that is peculiar lies where one of

    ξ₁ = (c − x)/g,   ξ₂ = (c + x)/g,   cosθ = g √(ξ₁ ξ₂),

is a whole number, whatever the wavelength: just above it an order's share rises as the root of the
distance. A `GratingGrid` has its nodes there, nearly evenly in the root.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...optics.geometry import wavenumber
from ..sampling import PER_PERIOD, OrderMixture
from ..table import DiffractionTable
from .grid import Interpolation

Real = NDArray[np.float64]

#: Nodes from one whole ξ to the next, up to `LAST_NODE` evenly in (1 + DENSE) r/(r + DENSE) of the
#: root r; `ENDS` parts are left over for the half of a lobe that is above the horizon before its
#: centre is.
NODES, LAST_NODE, ENDS, DENSE = 8, 0.965, 2, 3.0
#: Beyond so many orders in all the general grid does: each appears hardly seen.
MOST_UNITS = 16
#: Lobes closer than this, in 1/σ, are no chain.
_SEPARATE = 4.0
_KAPPAS = 128


@dataclass(frozen=True)
class Grating:
    """What makes a table's surface a grating.

    Attributes
    ----------
    axis : unit vector in the patch along which heights change.
    spacing : |q| of the first order, rad/µm.
    nodes, last : of a `GratingGrid`, from one whole ξ to the next; and where those of the root end.
    """

    axis: tuple[float, float]
    spacing: float
    nodes: int = NODES
    last: float = LAST_NODE

    def units(self, shortest: float) -> int:
        """Whole numbers that ξ passes at the shortest wavelength (nm)."""
        return math.floor(2.0 * float(wavenumber(shortest)) / self.spacing) + 1

    def rows(self, shortest: float) -> int:
        """Of a `GratingGrid` for wavelengths from the shortest (nm) on."""
        return (self.units(shortest) + 1) * self.nodes

    def along(self, theta: ArrayLike, phi: ArrayLike) -> tuple[Real, Real]:
        """x, and c of directions (rad)."""
        sine = np.sin(np.asarray(theta, np.float64))
        cosine, sine_of_axis = self.axis
        x = sine * (cosine * np.cos(phi) + sine_of_axis * np.sin(phi))
        y = sine * (cosine * np.sin(phi) - sine_of_axis * np.cos(phi))
        return x, np.sqrt(1.0 - y**2)


@dataclass(frozen=True)
class GratingGrid:
    """Nodes in (ξ₁, ξ₂) at one wavelength (nm); values on it have the shape (rows, rows)."""

    grating: Grating
    rows: int
    wavelength: float

    def interpolation(self, theta: ArrayLike, phi: ArrayLike) -> Interpolation:
        """From values on the grid to directions (rad), of any one shape."""
        x, c = self.grating.along(*np.broadcast_arrays(theta, phi))
        per_x = float(wavenumber(self.wavelength)) / self.grating.spacing
        nodes = self.grating.nodes, self.grating.last
        return self.at(*(position_of(per_x * (c + sign * x), *nodes) for sign in (-1, 1)))

    def at(self, row: Real, column: Real) -> Interpolation:
        """To rows and columns amid the nodes."""
        row, column = (np.clip(place, 0.0, self.rows - 1.0) for place in (row, column))
        i, j = (np.minimum(p.astype(np.int32), self.rows - 2) for p in (row, column))
        left = i * self.rows + j
        s, t = (row - i).astype(np.float32), (column - j).astype(np.float32)
        return Interpolation(left, left + 1, self.rows, self.rows**2, s, t)


def position_of(xi: Real, nodes: int = NODES, last: float = LAST_NODE) -> Real:
    """Row or column of ξ: `nodes` from one whole number to the next."""
    whole, parts = np.floor(np.maximum(xi, 0.0)), nodes - ENDS
    rest = np.maximum(xi, 0.0) - whole
    root = np.sqrt(rest / last)
    within = (1.0 + DENSE) * root / (root + DENSE) * parts
    beyond = parts + (rest - last) / (1.0 - last) * ENDS
    return np.asarray(nodes * whole + np.where(rest < last, within, beyond))


def fractions(places: ArrayLike, nodes: int = NODES, last: float = LAST_NODE) -> Real:
    """ξ above a whole number of places among the nodes there, 0 to `nodes`."""
    places = np.asarray(places, np.float64)
    parts = nodes - ENDS
    within = np.minimum(places / parts, 1.0)
    root = DENSE * within / (1.0 + DENSE - within)
    beyond = np.maximum(places - parts, 0.0) / ENDS
    return np.asarray(last * root**2 + (1.0 - last) * beyond)


def grating_of(
    table: DiffractionTable, most_units: int = MOST_UNITS
) -> tuple[Grating, NDArray[np.int64]] | None:
    """The grating, if a table has the orders of one only, and their bins (n, 2)."""
    if table.grid.coherent or table.limited:
        return None
    rows, columns = np.nonzero(table.coefficients.any(axis=(0, 3, 4)))
    bins = np.stack([columns, rows], axis=1).astype(np.int64) - np.array(table.grid.last)
    grating = on_one_line(table, bins, most_units)
    if grating is None or grating.spacing * table.sigma <= _SEPARATE:
        return None
    return grating, bins


def on_one_line(
    table: DiffractionTable, bins: NDArray[np.int64], most_units: int = MOST_UNITS
) -> Grating | None:
    """The grating of a table's bins (n, 2) of |q|, if it is one, of few orders."""
    bins = bins[bins.any(axis=1)]  # q = 0 is on every line
    if not len(bins):
        return None
    first = bins[0]
    if np.any(first[0] * bins[:, 1] != first[1] * bins[:, 0]):
        return None
    step = first // np.gcd(*first) * np.gcd.reduce(np.gcd(bins[:, 0], bins[:, 1]))
    vector = step * np.array(table.spacing)
    spacing = float(np.hypot(*vector))
    grating = Grating((float(vector[0] / spacing), float(vector[1] / spacing)), spacing)
    return grating if grating.units(table.wavelength_range[0]) <= most_units else None


def orders_of(
    table: DiffractionTable, bins: NDArray[np.int64], height_scale: float
) -> OrderMixture:
    """All orders of a grating as strong ones."""
    expansion = table.expansion
    kappa_max = min(table.q_limit * height_scale, expansion.kappa_max)
    count = math.ceil(PER_PERIOD * kappa_max * expansion.half_range / math.pi) + _KAPPAS + 1
    kappas = np.linspace(0.0, kappa_max, count)
    columns, rows = (bins + np.array(table.grid.last)).T
    own = table.coefficients[:, rows, columns].astype(np.float64)
    weights = expansion.weights(kappas) / table.scale
    parts = np.einsum("knct,kt->knc", own[expansion.interval(kappas)], weights)
    centre = table.order_0_at(kappas)
    if expansion.kind == "power":
        powers, central = np.maximum(parts[..., 0], 0.0), np.maximum(centre[..., 0], 0.0)
    else:
        powers, central = np.sum(parts**2, axis=-1), np.sum(centre**2, axis=-1)
    return OrderMixture(
        kappa_step=float(kappas[1]) / height_scale,
        frequency=bins * np.array(table.spacing),
        powers=powers.astype(np.float32),
        central=central,
        density=np.zeros((2, 2, 2), np.float32),
        pitch=1.0,
        uncertainty=0.0,
    )
