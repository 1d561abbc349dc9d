"""The scale of a grating's directions, chain by chain (NumPy only).

Light that comes along one of the directions ξ = (k + f₁, N − k + f₂), k = 0 … N, leaves along those
with (l + f₂, N − l + f₁), and light that comes along these leaves along the former (`grating`): a
matrix M with its transpose, of a few directions each, whatever lies between them. So the scaling

    s_k Σ_l M_kl s_l = min(a_k, 1)

is one of each chain for itself. It has a solution if both halves of a chain
are to reflect the same in all, Σ_k min(a_k, 1) = Σ_l min(a_l, 1), as M's symmetry wants. On a
symmetric profile the halves mirror each other. On a blazed one they do not: what one half may
reflect and the other cannot send is lost to any reciprocal model (`Chains.most_kept`). It is taken
first from those directions of that half which reflect more than comes in, up to a tenth, and then
from all alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .fit import GAINS, Samples, limits
from .gain import LEAST_COSINE, fade, fades, over_lobe
from .grating import Grating, GratingGrid, fractions
from .grid import LAST_ANGLE
from .transport import Orders, lobe_means, lobes

Real = NDArray[np.float64]
Array = NDArray[np.float32]

#: Of what reciprocity takes, directions above 1 lose at most this share of theirs before all do.
GIVEN = 0.1


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

    def shares(
        self, first: Real, second: Real, last: int, steepest: bool = False, faded: bool = False
    ) -> Real:
        """M (..., last + 1, last + 3), from ξ = (k + first, last − k + second), any one shape.

        To l = −1 … last + 1: of lobes just beyond the horizon a part is above it. Where the chain
        would be wider than the hemisphere it is that of the longest wavelength that has it.

        steepest : what comes along the horizon is taken to be as close to it as the grids end, not
        as a lobe there is on the mean. faded : whether by `gain.fade`.
        """
        first, second = first[..., None, None], second[..., None, None]
        width = last + first + second
        g = self._step(width)
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

        def at(cos_i: Real, cos_o: Real, turn: Real) -> Real:
            found = self.gain.at(cos_i, cos_o, turn)
            return found * fade(cos_i, cos_o) if faded else found

        gain = at(cos_i, cos_o, turn)
        cos_i, cos_o, pole = np.broadcast_arrays(cos_i, cos_o, pole, turn)[:3]
        near = cos_o * pole > 1.001
        end = np.full(np.count_nonzero(near), LEAST_COSINE)
        at_horizon = at(cos_i[near], end, turn[near]) * LEAST_COSINE
        gain[near] = over_lobe(gain[near], at_horizon, cos_o[near], pole[near])
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

    def samples(self, rows: int, units: int, page: float, places: Real) -> Samples:
        """Chains' albedos, at places between whole ξ, those of a `GratingGrid`'s nodes.

        rows : of the grid; units : of the longest chain that is looked at.
        """
        nodes, count = self.grating.nodes, len(places)
        f = fractions(places, nodes)
        first, second = np.broadcast_arrays(f[:, None], f)
        shares, at, found, starts = [], [], [], [0]
        for last in range(units + 1):
            m, k = self.shares(first, second, last, True), np.arange(last + 1)
            raw = m.sum(axis=-1)
            if fades(self.gain.model):
                m = self.shares(first, second, last, True, True)
            row, column = places[:, None] + nodes * k, places[:, None] + nodes * (last - k)
            at.append(np.broadcast_arrays(row[:, None], column))
            found.append(self._limits(raw, m.sum(axis=-1), first, second, last))
            shares.append(m)
            starts.append(starts[-1] + count**2 * (last + 1))
        here = GratingGrid(self.grating, rows, 2e3 * np.pi / self.gain.wavenumber).at(*_flat(at))
        reached = np.concatenate([_reached(count, n) + at for n, at in enumerate(starts[:-1])])
        ends = np.concatenate([np.full(m[..., 0].size, m.shape[-1]) for m in shares])
        matrix = sparse.csr_array(
            (
                np.concatenate([m.ravel() for m in shares]).astype(np.float32),
                reached,
                np.append(0, np.cumsum(ends)),
            ),
            shape=(starts[-1], starts[-1]),
        )
        return Samples(page, here, lambda values: matrix @ here(values), *_flat(found))

    def _limits(
        self, raw: Real, faded: Real, first: Real, second: Real, last: int
    ) -> tuple[Real, Real]:
        """As `fit.limits`, as far as reciprocity lets them be."""
        g, k = self._step(last + first + second)[..., None], np.arange(last + 1)
        ends = (k + first[..., None]) * (last - k + second[..., None])
        low, high = limits(raw, g * np.sqrt(ends), faded)
        lacking = np.maximum(low.sum(axis=-1) - high.sum(axis=-1).T, 0.0)[..., None]
        gives = low * np.clip((raw - 1.0) / (GAINS - 1.0), 0.0, 1.0)
        give = gives.sum(axis=-1)[..., None]
        low = low - gives * np.minimum(lacking / np.maximum(give, 1e-12), GIVEN)
        return low * balance(low.sum(axis=-1), high.sum(axis=-1).T)[..., None], high

    def _step(self, width: Real) -> Real:
        """g, of chains wider than the hemisphere that of the longest wavelength that has them."""
        g = self.grating.spacing / self.gain.wavenumber
        return np.minimum(g, 2.0 / np.maximum(width, 1e-9))

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


def balance(total: Real, other: Real) -> Real:
    """What may be kept of a half's sum, where the other half's may be less."""
    return np.asarray(np.minimum(1.0, other / np.maximum(total, 1e-12)))


def _flat(parts: list[Any]) -> tuple[Real, Real]:
    """Pairs of arrays, one after the other."""
    one, other = (
        np.concatenate([part.ravel() for part in side]) for side in zip(*parts, strict=True)
    )
    return one, other


def reflected(shares: Real, s: NDArray[np.floating]) -> Real:
    """Σ_l M_kl s_l: the other halves' s, and that of their ends beyond the horizon."""
    return np.asarray(np.einsum("...ko,...o->...k", shares, _padded(s.swapaxes(0, 1))))


def _reached(count: int, last: int) -> NDArray[np.int_]:
    """Where `reflected` finds s among that of all places (count, count, last + 1)."""
    places = np.arange(count**2 * (last + 1), dtype=float).reshape(count, count, -1)
    padded = _padded(places.swapaxes(0, 1))[:, :, None].astype(int)
    return np.repeat(padded, last + 1, axis=2).ravel()


def _padded(s: NDArray[np.floating]) -> Real:
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
