"""The scale of a grating's directions, chain by chain (NumPy only).

Light that comes along one of the directions ξ = (k + f₁, N − k + f₂), k = 0 … N, leaves along those
with (l + f₂, N − l + f₁), and light that comes along these leaves along the former (`grating`): a
matrix M with its transpose, of a few directions each, whatever lies between them. So the scaling

    s_k Σ_l M_kl s_l = min(a_k, 1)

is solved exactly at every node, with no interpolation. It has a solution if both halves of a chain
are to reflect the same in all, Σ_k min(a_k, 1) = Σ_l min(a_l, 1), as M's symmetry wants. On a
symmetric profile the halves mirror each other. On a blazed one they do not: what one half may
reflect and the other cannot send is lost to any reciprocal model, and is taken from all of that
half alike (`Chains.most_kept`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .gain import LEAST_COSINE, over_lobe
from .grating import NODES, Grating, fractions
from .grid import LAST_ANGLE
from .transport import Orders, lobe_means, lobes

Real = NDArray[np.float64]
Array = NDArray[np.float32]

SWEEPS = 40
#: Nodes and parts of cells, from a whole ξ, where orders come up.
SPIKES = (0.0, 0.25, 0.75, NODES - 1.0)


class OrderGain(Protocol):
    """G of one wavelength: `gain.Gain`, or `sheet.LinkGain`."""

    @property
    def wavenumber(self) -> float: ...

    @property
    def model(self) -> str: ...

    def at(self, cos_i: Real, cos_o: Real, turn: Real) -> Real:
        """G at cosines and the azimuth between them."""

    def width(self, cos_i: Real, cos_o: Real) -> Real:
        """κ over the wavenumber."""


@dataclass(frozen=True)
class Chains:
    """All chains of a grating in light of one wavelength.

    Attributes
    ----------
    orders : of the grating.
    grating : the same.
    gain : of model and material.
    sign : of the orders' numbers.
    """

    orders: Orders
    grating: Grating
    gain: OrderGain
    sign: int = 1

    def shares(self, first: Real, second: Real, last: int, steepest: bool = False) -> Real:
        """M (..., last + 1, last + 3), from ξ = (k + first, last − k + second), any one shape.

        To l = −1 … last + 1: of lobes just beyond the horizon a part is above it. Where the chain
        would be wider than the hemisphere it is that of the longest wavelength that has it.

        steepest : what comes along the horizon is taken to be as close to it as the grids end, not
        as a lobe there is on the mean.
        """
        first, second = first[..., None, None], second[..., None, None]
        width = last + first + second
        g = np.minimum(self.grating.spacing / self.gain.wavenumber, 2.0 / np.maximum(width, 1e-9))
        k, o = np.arange(last + 1.0)[:, None], np.arange(-1.0, last + 2.0)
        x, x_o = (
            0.5 * g * (last - 2 * k + second - first),
            0.5 * g * (last - 2 * o + first - second),
        )
        y_squared = np.maximum(1.0 - (0.5 * g * width) ** 2, 0.0)
        radius = np.sqrt(x_o**2 + y_squared)
        lobe = self.orders.sigma, self.gain.wavenumber
        share, cos_o, pole = lobe_means(*lobe, radius)
        least = math.cos(LAST_ANGLE) if steepest else float(lobes(*lobe)[2][-1])
        cos_i = np.sqrt(np.maximum(1.0 - x**2 - y_squared, least**2))
        w = self.gain.width(cos_i, np.sqrt(np.maximum(1.0 - radius**2, 0.0)))
        power = self._powers(
            self.sign * np.rint(last - k - o).astype(int), self.grating.spacing / g * w
        )
        across = np.hypot(x, np.sqrt(y_squared)) * radius
        turn = (x * x_o - y_squared) / np.maximum(across, 1e-12)
        turn = np.arccos(np.clip(turn, -1.0, 1.0))
        gain = self.gain.at(cos_i, cos_o, turn)
        end = np.full_like(cos_o, LEAST_COSINE)
        gain = over_lobe(gain, self.gain.at(cos_i, end, turn) * LEAST_COSINE, cos_o, pole)
        return np.asarray(power * share * gain)

    def _powers(self, number: NDArray[np.int_], kappa: Real) -> Real:
        """|a_m|² at κ, broadcast."""
        mixture, axis = self.orders.mixture, np.array(self.grating.axis)
        numbers = np.rint(mixture.frequency @ axis / self.grating.spacing).astype(int)
        most = max(int(np.abs(numbers).max(initial=0)), int(np.abs(number).max()))
        table = np.zeros((len(mixture.central), 2 * most + 1))
        table[:, numbers + most] = mixture.powers
        table[:, most] = mixture.central
        place = np.minimum(kappa / mixture.kappa_step, len(table) - 1.001)
        low = place.astype(int)
        flat, index = table.ravel(), low * table.shape[1] + number + most
        share = place - low
        return np.asarray(flat[index] * (1.0 - share) + flat[index + table.shape[1]] * share)

    def scale(self, units: int, target: float, largest: float) -> Array:
        """s at the nodes of a `GratingGrid` of (units + 1) `NODES` rows."""
        rows = (units + 1) * NODES
        values = np.ones((rows, rows), np.float32)
        f = fractions(np.arange(NODES))
        first, second = np.broadcast_arrays(f[:, None], f)
        for last in range(units + 1):
            shares = self.shares(first, second, last)
            aim = np.minimum(shares.sum(axis=-1), target)
            total = aim.sum(axis=-1)
            aim *= balance(total, total.T)[..., None]
            s = scaled(shares, aim, largest)
            self._lower_horizon(s, last, target)
            put(values, s, last)
        return values

    def most_kept(self, first: Real, second: Real, last: int) -> Real:
        """Of min(a, 1), what a reciprocal BRDF of the same orders can keep everywhere in a chain.

        Its f cosθo dω from k to l is that from l to k, so what it reflects of both halves is one
        sum: of the half that may reflect more some direction loses at least this share.
        """
        totals = [
            np.minimum(self.shares(*ends, last).sum(axis=-1), 1.0).sum(axis=-1)
            for ends in ((first, second), (second, first))
        ]
        return balance(*totals)

    def _lower_horizon(self, s: Real, last: int, target: float) -> None:
        """Nodes at the horizon are met by light that comes yet closer to it."""
        f = fractions(np.arange(NODES))
        low = self.shares(np.zeros(1), f, last, True)[:, 0]
        high = self.shares(f, np.zeros(1), last, True)[:, last]
        ends = [np.sum(m * _padded(o), axis=-1) for m, o in ((low, s[:, 0]), (high, s[0]))]
        s[0, :, 0] = np.minimum(s[0, :, 0], target / np.maximum(ends[0], target))
        s[:, 0, last] = np.minimum(s[:, 0, last], target / np.maximum(ends[1], target))

    def sums(self, units: int) -> list[Real]:
        """M of all chains at `_places`, for `excess`."""
        f = fractions(self._places)
        first, second = np.broadcast_arrays(f[:, None], f)
        return [self.shares(first, second, last, True) for last in range(units + 1)]

    def excess(self, sums: list[Real], values: Array, limit: float) -> Array:
        """By what factor, at least 1, the albedo around each node is above a limit."""
        low = self._places.astype(int)
        share = (self._places - low)[:, None]
        padded = np.pad(values, 1, mode="edge")[1:, 1:].astype(np.float64)
        found = np.ones_like(padded)
        for last, shares in enumerate(sums):
            cells = [(k * NODES + low[:, None], (last - k) * NODES + low) for k in range(last + 1)]
            s = np.stack([_bilinear(padded, *cell, share) for cell in cells], axis=-1)
            over = s * reflected(shares, s) / limit
            for k, (row, column) in enumerate(cells):
                for down, right in ((0, 0), (0, 1), (1, 0), (1, 1)):
                    np.maximum.at(found, (row + down, column + right), over[..., k])
        return found[:-1, :-1].astype(np.float32)

    @property
    def _places(self) -> Real:
        """Where between nodes albedos are looked at: amid, and where Kirchhoff's has its spikes."""
        amid = np.arange(NODES) + 0.5
        return np.append(amid, SPIKES if self.gain.model == "kirchhoff" else [])


def balance(total: Real, other: Real) -> Real:
    """What may be kept of a half's sum, where the other half's may be less."""
    return np.asarray(np.minimum(1.0, other / np.maximum(total, 1e-12)))


def _bilinear(values: Real, row: NDArray[np.int_], column: NDArray[np.int_], share: Real) -> Real:
    """Between four nodes each; `share` of the next row, and of the next column."""
    low, high = (
        values[r, column] * (1.0 - share.T) + values[r, column + 1] * share.T
        for r in (row, row + 1)
    )
    return np.asarray(low * (1.0 - share) + high * share, np.float64)


def scaled(shares: Real, aim: Real, largest: float) -> Real:
    """s (f, f', last + 1) of chains whose other halves have f and f' swapped."""
    s = np.ones_like(aim)
    for _ in range(SWEEPS):
        s = np.minimum(s * np.sqrt(aim / np.maximum(s * reflected(shares, s), 1e-6)), largest)
    return s


def reflected(shares: Real, s: Real) -> Real:
    """Σ_l M_kl s_l: the other halves' s, and that of their ends beyond the horizon."""
    return np.asarray(np.einsum("...ko,...o->...k", shares, _padded(s.swapaxes(0, 1))))


def _padded(s: Real) -> Real:
    return np.asarray(np.concatenate([s[..., :1], s, s[..., -1:]], axis=-1), np.float64)


def put(values: NDArray[np.floating[Any]], s: Real, last: int) -> None:
    """s (nodes, nodes, last + 1) into the nodes (rows, rows) of `GratingGrid`."""
    nodes = len(s)
    for k in range(last + 1):
        row, column = k * nodes, (last - k) * nodes
        values[row : row + nodes, column : column + nodes] = s[..., k]


def taken(values: Array, last: int, nodes: int) -> Array:
    """The inverse of `put`."""
    parts = values.reshape(len(values) // nodes, nodes, -1, nodes)
    k = np.arange(last + 1)
    return np.asarray(np.moveaxis(parts[k, :, last - k], 0, -1))
