"""Sums over the orders for directions of incidence, at one wavelength (NumPy only).

With q = k(ωi + ωo) in the tangent plane, dωo = d²q/(k² cosθo) turns ∫f s cosθo dωo, the albedo with
the light along ωo weighted by s(ωo), into a sum over the orders' lobes,

    a(ωi) = Σ_j ∫ |a_j(κ)|² (σ²/π) exp(−σ²|q − q_j|²) G(ωi, ωo) s(ωo) d²q,

over the frequencies that are visible, with κ = k w times the height scale and G as in `gain`.
G is smooth but for 1/cosθo in Kirchhoff's: an order that grazes the horizon (a Rayleigh anomaly) is
a spike of the albedo then, as narrow as the lobe. Hence three sums:

- order 0, the mirror direction, by quadrature over its lobe;
- the few *strong* orders, one by one, with means over the lobe tabulated against its place;
- the many *weak* ones as a smooth density, by quadrature over directions, where no pole is left.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import i0e

from ...optics.fresnel import Filmed
from ...optics.geometry import wavenumber
from ..sampling import order_mixture
from ..table import DiffractionTable
from .gain import LEAST_COSINE, Gain
from .grid import Array, DirectionGrid, LinearMap, Real
from .settings import EnergySettings, energy_settings

#: The weak orders are smoothed by this share of the distance between those directions, at least.
SMOOTHING = 0.6
#: Weak orders of less power in all are left out.
LEAST_WEAK = 2e-3

_LOBE = 3.5  # a lobe ends here, in units of 1/σ: exp(−3.5²) = 5e-6
_LOBE_NODES = 96  # in cosθo across a lobe


class Orders:
    """A table's orders, sorted for one height scale.

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
        # not the table, which may keep these
        self.sigma, self.roughness = table.sigma, table.roughness
        self.height_scale, self.settings = height_scale, settings or energy_settings()
        longest = float(wavenumber(table.wavelength_range[0]))
        smoothing = SMOOTHING * longest * 0.5 * math.pi / self.settings.rings
        self.mixture = order_mixture(table, height_scale, smoothing, apart=apart)
        total = self.mixture.density.sum(axis=(1, 2)).max() * self.mixture.pitch**2
        self.has_weak = bool(total > LEAST_WEAK)
        self.nodes = _directions(self.settings.rings, self.settings.steps)

    def level(self) -> Orders:
        """Orders of no heights: order 0 alone."""
        flat, mixture = copy.copy(self), self.mixture
        flat.has_weak = False
        flat.mixture = replace(
            mixture,
            frequency=mixture.frequency[:0],
            powers=mixture.powers[:, :0],
            central=np.ones_like(mixture.central),
        )
        return flat

    def gain(self, wavelength: float, model: str, index: complex | Filmed | None) -> Gain:
        """G of a model and material at a wavelength (nm)."""
        k = float(wavenumber(wavelength))
        return Gain(self.roughness, model, index, k, self.height_scale)

    def transport(
        self, theta: Real, phi: Real, gain: Gain, grid: DirectionGrid, *, faded: bool = False
    ) -> Transport:
        """Return the map from weights on a grid to albedos at angles (t,) and azimuths (p,), rad.

        faded : whether by `gain.fade`.
        """
        half = DirectionGrid(min(grid.polar // 2, 24), min(grid.azimuthal // 2, 30))
        ways = self._reflected(theta, gain, faded)
        weak, strong = None, None
        if self.has_weak:
            turned = half.phi[:, None] + self.nodes.azimuth
            weak = Weak(
                np.stack([way.weak(half.phi) for way in self._reflected(half.theta, gain, faded)]),
                grid.interpolation(self.nodes.theta, turned),
                half.interpolation(theta[:, None], phi),
            )
        if len(self.mixture.frequency):
            shares, polar, azimuth = (
                np.stack(part) for part in zip(*(way.strong(phi) for way in ways), strict=True)
            )
            strong = grid.interpolation(polar, azimuth).summed(shares.astype(np.float32), grid)
        return Transport(Mirrored.of([way.mirrored(grid) for way in ways], phi, grid), weak, strong)

    def _reflected(self, theta: Real, gain: Gain, faded: bool) -> list[Way]:
        k, gains = gain.wavenumber, gain.at(theta, faded)
        return [
            Way(self, k, math.sin(angle), _kappa(k, math.cos(angle)), of_angle)
            for angle, of_angle in zip(theta.tolist(), gains, strict=True)
        ]


def _kappa(k: float, cos_i: float) -> Callable[[Real], Real]:
    return lambda cos_o: np.asarray(k * (cos_i + cos_o))


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
        result = self.mirrored(s)
        for part in (self.weak, self.strong):
            if part is not None:
                result = result + part(s)
        return np.asarray(result, np.float32)


@dataclass(frozen=True)
class Way:
    """Light of one polar angle of incidence that goes to one side.

    Attributes
    ----------
    orders : of the surface.
    k : wavenumber where the light goes to, rad/µm.
    sine : of the mirrored or refracted direction; more than 1 where there is none.
    kappa : κ of light that leaves at cosθo, rad/µm.
    gain : G at cosθo and φo − φi.
    gain_0 : G of order 0, if it is another.
    sign : of the orders' frequencies.
    """

    orders: Orders
    k: float
    sine: float
    kappa: Callable[[Real], Real]
    gain: Callable[[Real, Real], Real]
    gain_0: Callable[[Real, Real], Real] | None = None
    sign: float = 1.0

    def mirrored(self, grid: DirectionGrid) -> Real:
        """Shares of order 0 that go to the polar angles of a grid, (rows,).

        The distance from the normal of a Gaussian lobe has Rice's distribution; in cosθo, since
        d(sinθo)/cosθo = d(cosθo)/sinθo has no pole at the horizon.
        """
        shares = np.zeros(grid.polar + 1)
        width = 1.0 / (self.orders.sigma * self.k)  # in direction cosines
        low, high = max(self.sine - _LOBE * width, 0.0), min(self.sine + _LOBE * width, 1.0)
        if low >= 1.0:
            return shares
        ends = math.sqrt(1.0 - high**2), math.sqrt(1.0 - low**2)
        step = (ends[1] - ends[0]) / _LOBE_NODES
        cos_o = ends[0] + step * (np.arange(_LOBE_NODES) + 0.5)
        sin_o = np.sqrt(1.0 - cos_o**2)
        lobe = np.exp(-(((sin_o - self.sine) / width) ** 2)) * 2.0 * step / width**2 * cos_o
        lobe *= i0e(2.0 * sin_o * self.sine / width**2)
        gain = (self.gain_0 or self.gain)(cos_o, np.full(_LOBE_NODES, math.pi))
        parts = lobe * self.orders.mixture.order_0(self.kappa(cos_o)) * gain
        row = grid.row(np.arccos(cos_o))
        lower = np.minimum(row.astype(int), grid.polar - 1)
        np.add.at(shares, lower, parts * (1.0 - (row - lower)))
        np.add.at(shares, lower + 1, parts * (row - lower))
        return shares

    def weak(self, phi: Real) -> Array:
        """Shares (p, n) of the quadrature's directions."""
        mixture, k, nodes = self.orders.mixture, self.k, self.orders.nodes
        gain = self.gain(nodes.cosine, nodes.azimuth)
        factor = (k**2 * nodes.weights * nodes.cosine * gain).astype(np.float32)
        position = np.minimum(
            self.kappa(nodes.cosine) / mixture.kappa_step, len(mixture.density) - 1.001
        )
        lower = position.astype(np.int32)
        upper_share = (position - lower).astype(np.float32)
        layer = mixture.density[0].size
        scale = self.sign * k / mixture.pitch
        bx, by = scale * (nodes.x + self.sine), scale * nodes.y
        sin, cos = np.sin(phi)[:, None], np.cos(phi)[:, None]
        rows, columns = mixture.density.shape[1:]
        column = (cos * bx - sin * by + 0.5 * columns).astype(np.int32)
        row = (sin * bx + cos * by + 0.5 * rows).astype(np.int32)
        np.clip(column, 0, columns - 1, out=column)
        np.clip(row, 0, rows - 1, out=row)
        index = row * columns + column + lower * layer
        flat = mixture.density.ravel()
        result = flat.take(index) * (factor * (1.0 - upper_share))
        result += flat.take(index + layer) * (factor * upper_share)
        return result

    def strong(self, phi: Real) -> tuple[Real, Real, Real]:
        """Shares (p, m) of the strong orders, and their θo and azimuths."""
        mixture, k = self.orders.mixture, self.k
        places = mixture.frequency * (self.sign / k)
        x = places[:, 0] - self.sine * np.cos(phi)[:, None]
        y = places[:, 1] - self.sine * np.sin(phi)[:, None]
        radius, azimuth = np.hypot(x, y), np.arctan2(y, x)
        share, cos_o, pole = _lobe_means(self.orders.sigma, k, radius)
        power = mixture.strong_at(self.kappa(np.sqrt(np.maximum(1.0 - radius**2, 0.0))))
        turn = azimuth - phi[:, None]
        gain = self.gain(cos_o, turn)
        # G cosθ is linear in cosθ across a lobe whose mean of 1/cosθ is `pole`
        near = cos_o * pole > 1.001
        end = np.full(np.count_nonzero(near), LEAST_COSINE)
        at_horizon = self.gain(end, turn[near]) * LEAST_COSINE
        rising = np.clip(at_horizon / np.maximum(gain[near] * cos_o[near], 1e-30), 0.0, 1.0)
        gain[near] *= 1.0 + rising * (cos_o[near] * pole[near] - 1.0)
        return power * gain * share, np.arccos(cos_o), azimuth


def _lobe_means(sigma: float, k: float, radius: Real) -> tuple[Real, Real, Real]:
    """Return the visible share of lobes, and its means of cosθo and of 1/cosθo.

    radius : of their centres from the normal, in direction cosines.
    """
    places, *means = _lobes(sigma, k)
    place = np.interp(radius, places, np.arange(float(len(places))))
    low = np.minimum(place.astype(np.int32), len(places) - 2)
    share = place - low
    visible, cosine, pole = (mean[low] * (1.0 - share) + mean[low + 1] * share for mean in means)
    return np.where(radius < places[-1], visible, 0.0), cosine, pole


@lru_cache(maxsize=64)
def _lobes(sigma: float, k: float) -> tuple[Real, Real, Real, Real]:
    """Tabulate `_lobe_means` at distances from the normal, which come first."""
    width = 1.0 / (sigma * k)
    edge = max(1.0 - 2.0 * _LOBE * width, 0.0)
    deepest = math.sqrt(1.0 - max(edge - _LOBE * width, 0.0) ** 2)
    cosines = (np.arange(_LOBE_NODES) + 0.5) * (deepest / _LOBE_NODES)
    sines = np.sqrt(1.0 - cosines**2)
    places = np.linspace(edge, 1.0 + _LOBE * width, 96)
    lobes = np.exp(-(((sines - places[:, None]) / width) ** 2))
    lobes *= deepest / _LOBE_NODES / (math.sqrt(math.pi) * width) * cosines / sines
    visible = np.minimum(lobes.sum(axis=1), 1.0)
    safe = np.maximum(visible, 1e-30)
    inner = np.linspace(0.0, edge, 200, endpoint=False)
    flat = np.sqrt(1.0 - inner**2)
    return (
        np.concatenate([inner, places]),
        np.concatenate([np.ones_like(inner), visible]),
        np.concatenate([flat, lobes @ cosines / safe]),
        np.concatenate([1.0 / flat, lobes @ (1.0 / cosines) / safe]),
    )


class Nodes(NamedTuple):
    """Quadrature over the hemisphere: directions (n,) and their solid angles."""

    x: Real
    y: Real
    cosine: Real
    weights: Real

    @property
    def theta(self) -> Real:
        """Polar angles, rad."""
        return np.arccos(self.cosine)

    @property
    def azimuth(self) -> Real:
        """Azimuths, rad."""
        return np.arctan2(self.y, self.x)


@lru_cache(maxsize=4)
def _directions(rings: int, widest: int) -> Nodes:
    """Place directions on rings, as many azimuths on the widest as `widest`."""
    position, share = np.polynomial.legendre.leggauss(rings)
    parts: list[list[Real]] = [[], [], [], []]
    for n, (angle, weight) in enumerate(
        zip(0.25 * np.pi * (position + 1.0), share * 0.25 * np.pi, strict=True)
    ):
        steps = max(8, round(widest * math.sin(angle)))
        azimuth = (np.arange(steps) + 0.381966 * n) * (2.0 * np.pi / steps)
        sine = math.sin(angle)
        parts[0].append(sine * np.cos(azimuth))
        parts[1].append(sine * np.sin(azimuth))
        parts[2].append(np.full(steps, math.cos(angle)))
        parts[3].append(np.full(steps, weight * sine * 2.0 * np.pi / steps))
    return Nodes(*(np.concatenate(part) for part in parts))
