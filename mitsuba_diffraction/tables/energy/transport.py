"""Sums over the orders for directions of incidence, at one wavelength (NumPy only).

With q = k(ωi + ωo) in the tangent plane, dωo = d²q/(k² cosθo) turns ∫f s cosθo dωo, the albedo with
the light along ωo weighted by s(ωo), into a sum over the orders' lobes,

    a(ωi) = Σ_j ∫ |a_j(κ)|² (σ²/π) exp(−σ²|q − q_j|²) G(ωi, ωo) s(ωo) d²q,

over the frequencies that are visible, with κ = k w times the height scale and G as in `gain`:

- order 0, the mirror direction, by quadrature over its lobe;
- the few *strong* orders, one by one, with means over the lobe tabulated against its place, since
  an order that grazes the horizon (a Rayleigh anomaly) is a spike of the albedo;
- the many *weak* ones as a smooth density, by quadrature over directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0e

from ...optics.geometry import wavenumber
from ..order_mixture import order_mixture
from ..powers import order_0_power
from ..table import DiffractionTable
from .gain import LEAST_COSINE, Boundary, Gain
from .grid import Array, DirectionGrid, LinearMap, Real
from .settings import EnergySettings, energy_settings

#: The weak orders are smoothed by this share of the distance between directions, at least.
SMOOTHING = 0.6
#: Weak orders of less power in all are left out.
LEAST_WEAK = 2e-3

_LOBE = 3.5  # a lobe ends here, in units of 1/σ: exp(−3.5²) = 5e-6
_LOBE_NODES = 96  # in cosθo across a lobe
_FINER = 16  # nodes of order 0's power from one κ of the mixture to the next


class Orders:
    """Orders of a table at one height scale, sorted into strong and weak ones.

    apart : whether order 0 is summed apart from others however wide its lobe is.
    """

    def __init__(
        self,
        table: DiffractionTable,
        height_scale: float = 1.0,
        settings: EnergySettings | None = None,
        *,
        apart: bool = False,
    ) -> None:
        self.sigma, self.roughness, self.height_scale = table.sigma, table.roughness, height_scale
        self.settings = settings or energy_settings()
        longest = float(wavenumber(table.wavelength_range[0]))
        smoothing = SMOOTHING * longest * 0.5 * math.pi / self.settings.rings
        self.mixture = order_mixture(table, height_scale, smoothing, apart=apart)
        total = self.mixture.density.sum(axis=(1, 2)).max() * self.mixture.pitch**2
        self.has_weak = bool(total > LEAST_WEAK)
        self.has_strong = len(self.mixture.frequency) > 0
        self.nodes = _directions(self.settings.rings, self.settings.steps)
        count = len(self.mixture.central)
        self._kappas = self.mixture.kappa_step * np.linspace(0.0, count - 1, _FINER * count)
        # nothing of it is left where it is among the weak ones
        powers = order_0_power(table, self._kappas * height_scale)
        self._powers = powers * (self.mixture.central.max() > 0.0)

    def order_0(self, kappa: Real) -> Real:
        """Power of order 0 at κ over the height scale."""
        return np.interp(kappa, self._kappas, self._powers)

    def gain(
        self, wavelength: float, boundary: Boundary, height_scale: float | None = None
    ) -> Gain:
        """G of a boundary at a wavelength (nm), of heights at another scale if given."""
        k = float(wavenumber(wavelength))
        return Gain(boundary, self.roughness, k, height_scale or self.height_scale)

    def transport(self, theta: Real, phi: Real, gain: Gain, grid: DirectionGrid) -> Transport:
        """Return the map from weights on a grid to albedos (t, p) at angles and azimuths, rad."""
        ways = [Way(self, gain, angle) for angle in theta.tolist()]
        weak, strong = None, None
        if self.has_weak:
            half = grid.half
            turned = half.phi[:, None] + self.nodes.azimuth
            parts = [Way(self, gain, at).weak(half.phi) for at in half.theta.tolist()]
            to_nodes = grid.interpolation(self.nodes.theta, turned)
            weak = Weak(np.stack(parts), to_nodes, half.interpolation(theta[:, None], phi))
        if self.has_strong:
            shares, polar, azimuth = (
                np.stack(part) for part in zip(*(way.strong(phi) for way in ways), strict=True)
            )
            strong = grid.interpolation(polar, azimuth).summed(shares.astype(np.float32))
        return Transport(Mirrored.of([way.mirrored(grid) for way in ways], phi, grid), weak, strong)


@dataclass(frozen=True)
class Mirrored:
    """Shares (t, rows) of order 0 that go to polar angles of a grid; azimuths (columns, p)."""

    shares: Real
    azimuths: Real

    @classmethod
    def of(cls, shares: Sequence[Real], phi: Real, grid: DirectionGrid) -> Mirrored:
        """Collect the shares of polar angles of incidence; phi : azimuths of incidence, rad."""
        column = np.mod(phi + math.pi, 2.0 * math.pi) * (grid.azimuthal / (2.0 * math.pi))
        lower, each = column.astype(int), np.arange(len(phi))
        azimuths = np.zeros((grid.azimuthal, len(phi)))
        azimuths[lower % grid.azimuthal, each] = 1.0 - (column - lower)
        azimuths[(lower + 1) % grid.azimuthal, each] += column - lower
        return cls(np.stack(shares), azimuths)

    def __call__(self, s: NDArray[np.floating]) -> Real:
        return np.asarray(self.shares @ s @ self.azimuths)


@dataclass(frozen=True)
class Weak:
    """Shares (t', p', n) that go to `nodes` (p', n), interpolated to `directions` (t, p)."""

    shares: Array
    nodes: LinearMap
    directions: LinearMap

    def __call__(self, s: Array) -> Array:
        return self.directions(np.einsum("tpn,pn->tp", self.shares, self.nodes(s)))


@dataclass(frozen=True)
class Transport:
    """Map a = M s from weights on the grid of directions to albedos (t, p), by kind of order."""

    mirrored: Mirrored
    weak: Weak | None
    strong: LinearMap | None

    def __call__(self, s: Array) -> Array:
        parts = [part(s) for part in (self.mirrored, self.weak, self.strong) if part is not None]
        return np.asarray(sum(parts), np.float32)


class Way:
    """Light of one polar angle of incidence (rad) that a boundary sends on."""

    def __init__(self, orders: Orders, gain: Gain, angle: float) -> None:
        self._orders, self._gain, self._boundary = orders, gain, gain.boundary
        self._cos = max(math.cos(angle), LEAST_COSINE)
        # wavenumber where the light goes to, and sine of the mirrored or refracted direction there
        self._k = gain.wavenumber * self._boundary.left
        self._sine = math.sin(angle) * self._boundary.came / self._boundary.left
        self._per_w = gain.wavenumber * gain.height_scale / orders.height_scale
        self._width = 1.0 / (orders.sigma * self._k)  # of a lobe, in direction cosines

    def _kappa(self, cos_o: Real) -> Real:
        w = self._boundary.width(np.asarray(self._cos), cos_o)
        return self._per_w * np.maximum(w, self._boundary.least)

    def mirrored(self, grid: DirectionGrid) -> Real:
        """Shares of order 0 that go to the polar angles of a grid, (rows,).

        The distance of a Gaussian lobe's directions from the normal has Rice's distribution. In
        cosθo, since d(sinθo)/cosθo = d(cosθo)/sinθo has no pole at the horizon.
        """
        shares, width = np.zeros(grid.polar + 1), self._width
        low, high = max(self._sine - _LOBE * width, 0.0), min(self._sine + _LOBE * width, 1.0)
        if low >= 1.0:
            return shares
        ends = math.sqrt(1.0 - high**2), math.sqrt(1.0 - low**2)
        step = (ends[1] - ends[0]) / _LOBE_NODES
        cos_o: Real = ends[0] + step * (np.arange(_LOBE_NODES, dtype=np.float64) + 0.5)
        sin_o = np.sqrt(1.0 - cos_o**2)
        parts = np.exp(-(((sin_o - self._sine) / width) ** 2)) * 2.0 * step / width**2 * cos_o
        parts *= i0e(2.0 * sin_o * self._sine / width**2)
        cos_i = np.asarray(self._cos)
        parts *= self._boundary.order_0(self._gain, cos_i, cos_o)
        if not self._boundary.flat:
            parts *= self._orders.order_0(self._per_w * self._boundary.width(cos_i, cos_o))
        row = grid.row(np.arccos(cos_o))
        lower = np.minimum(row.astype(int), grid.polar - 1)
        np.add.at(shares, lower, parts * (1.0 - (row - lower)))
        np.add.at(shares, lower + 1, parts * (row - lower))
        return shares

    def weak(self, phi: Real) -> Array:
        """Shares (p, n) of the quadrature's directions, at azimuths of incidence (p,), rad."""
        mixture, k, nodes = self._orders.mixture, self._k, self._orders.nodes
        gain = self._gain(self._cos, nodes.cosine, nodes.azimuth)
        factor = (k**2 * nodes.weights * nodes.cosine * gain).astype(np.float32)
        position = np.minimum(
            self._kappa(nodes.cosine) / mixture.kappa_step, len(mixture.density) - 1.001
        )
        lower = position.astype(np.int32)
        upper_share = (position - lower).astype(np.float32)
        scale = self._boundary.sign * k / mixture.pitch
        bx, by = scale * (nodes.x + self._sine), scale * nodes.y
        sin, cos = np.sin(phi)[:, None], np.cos(phi)[:, None]
        rows, columns = mixture.density.shape[1:]
        column = np.clip((cos * bx - sin * by + 0.5 * columns).astype(np.int32), 0, columns - 1)
        row = np.clip((sin * bx + cos * by + 0.5 * rows).astype(np.int32), 0, rows - 1)
        flat, index = mixture.density.ravel(), (lower * rows + row) * columns + column
        result = flat.take(index) * (factor * (1.0 - upper_share))
        result += flat.take(index + rows * columns) * (factor * upper_share)
        return result

    def strong(self, phi: Real) -> tuple[Real, Real, Real]:
        """Shares (p, m) of the strong orders, and their θo and azimuths."""
        mixture = self._orders.mixture
        places = mixture.frequency * (self._boundary.sign / self._k)
        x = places[:, 0] - self._sine * np.cos(phi)[:, None]
        y = places[:, 1] - self._sine * np.sin(phi)[:, None]
        radius, azimuth = np.hypot(x, y), np.arctan2(y, x)
        share, cos_o, pole = _lobe_means(self._width, radius)
        power = mixture.strong_at(self._kappa(np.sqrt(np.maximum(1.0 - radius**2, 0.0))))
        turn = azimuth - phi[:, None]
        gain = self._gain(self._cos, cos_o, turn)
        # G cosθ is linear in cosθ across a lobe whose mean of 1/cosθ is `pole`
        near = cos_o * pole > 1.001
        end = np.full(np.count_nonzero(near), LEAST_COSINE)
        at_horizon = self._gain(self._cos, end, turn[near]) * LEAST_COSINE
        rising = np.clip(at_horizon / np.maximum(gain[near] * cos_o[near], 1e-30), 0.0, 1.0)
        gain[near] *= 1.0 + rising * (cos_o[near] * pole[near] - 1.0)
        return power * gain * share, np.arccos(cos_o), azimuth


def _lobe_means(width: float, radius: Real) -> tuple[Real, Real, Real]:
    """Return the visible share of lobes, and its means of cosθo and of 1/cosθo.

    width : of the lobes, radius : of their centres from the normal; in direction cosines.
    """
    cosine = np.sqrt(np.maximum(1.0 - radius**2, 1e-12))
    edge, places, means = _lobes(width)
    at = radius > edge
    share_and_means = [np.ones_like(radius), cosine, 1.0 / cosine]
    for values, tabulated in zip(share_and_means, means, strict=True):
        values[at] = np.interp(radius[at], places, tabulated)
    share_and_means[0][radius >= places[-1]] = 0.0
    return share_and_means[0], share_and_means[1], share_and_means[2]


@lru_cache(maxsize=64)
def _lobes(width: float) -> tuple[float, Real, list[Real]]:
    """Tabulate `_lobe_means` where part of a lobe is beyond the horizon, from a distance on."""
    edge = max(1.0 - 2.0 * _LOBE * width, 0.0)
    deepest = math.sqrt(1.0 - max(edge - _LOBE * width, 0.0) ** 2)
    cosines = (np.arange(_LOBE_NODES) + 0.5) * (deepest / _LOBE_NODES)
    sines = np.sqrt(1.0 - cosines**2)
    places = np.linspace(edge, 1.0 + _LOBE * width, 96)
    lobes = np.exp(-(((sines - places[:, None]) / width) ** 2))
    lobes *= deepest / _LOBE_NODES / (math.sqrt(math.pi) * width) * cosines / sines
    visible = np.minimum(lobes.sum(axis=1), 1.0)
    safe = np.maximum(visible, 1e-30)
    return edge, places, [visible, lobes @ cosines / safe, lobes @ (1.0 / cosines) / safe]


class Nodes(NamedTuple):
    """Quadrature over the hemisphere: directions (n,), angles in rad, and their solid angles."""

    x: Real
    y: Real
    cosine: Real
    theta: Real
    azimuth: Real
    weights: Real


@lru_cache(maxsize=4)
def _directions(rings: int, widest: int) -> Nodes:
    """Place directions on rings, with `widest` azimuths on the widest."""
    position, share = np.polynomial.legendre.leggauss(rings)
    angles = 0.25 * np.pi * (position + 1.0)
    steps = np.maximum(8, np.rint(widest * np.sin(angles)).astype(int))
    theta, count = np.repeat(angles, steps), np.repeat(steps, steps)
    turn = np.concatenate([np.arange(n) + 0.381966 * ring for ring, n in enumerate(steps)])
    azimuth = np.mod(turn * 2.0 * np.pi / count + np.pi, 2.0 * np.pi) - np.pi
    weights = np.repeat(share * 0.25 * np.pi, steps) * np.sin(theta) * 2.0 * np.pi / count
    x, y = np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth)
    return Nodes(x, y, np.cos(theta), theta, azimuth, weights)
