"""The albedo of one wavelength on a grid of directions, as a linear map (NumPy only).

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

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...optics.fresnel import Filmed
from ...optics.geometry import wavenumber
from ..sampling import OrderMixture, order_mixture
from ..table import DiffractionTable
from .gain import LEAST_COSINE, Gain, fade, over_lobe, read
from .grating import MOST_UNITS, Grating, GratingGrid, grating_of, on_one_line, orders_of
from .grid import DirectionGrid, Interpolation, Summed

Real = NDArray[np.float64]
Array = NDArray[np.float32]

#: Directions of the quadrature over the weak orders: rings, and steps of azimuth on the widest.
RINGS, STEPS = 36, 80
#: The weak orders are smoothed by this share of the distance between those directions, at least.
SMOOTHING = 0.6
#: Weak orders of less power in all are left out.
LEAST_WEAK = 2e-3

_LOBE = 3.5  # a lobe ends here, in units of 1/σ: exp(−3.5²) = 5e-6
_LOBE_NODES = 96  # in cosθo across a lobe
_HERMITE = np.polynomial.hermite.hermgauss(5)


class Orders:
    """A table's orders, sorted for one height scale; `transport` sums over them."""

    def __init__(
        self, table: DiffractionTable, height_scale: float = 1.0, most_units: int = MOST_UNITS
    ) -> None:
        # not the table, which may keep these
        self.sigma, self.roughness = table.sigma, table.roughness
        self.height_scale = height_scale
        self.grating: Grating | None = None
        if (found := grating_of(table, most_units)) is not None:
            self.grating, bins = found
            self.mixture: OrderMixture = orders_of(table, bins, height_scale)
        else:
            longest = float(wavenumber(table.wavelength_range[0]))
            spacing = longest * 0.5 * math.pi / RINGS
            self.mixture = order_mixture(table, height_scale, SMOOTHING * spacing)
        #: the grating of all strong orders
        self.tracks: Grating | None = None
        if not table.grid.coherent and not table.limited:
            bins = np.rint(self.mixture.frequency / np.array(table.spacing)).astype(np.int64)
            self.tracks = on_one_line(table, bins)
        total = self.mixture.density.sum(axis=(1, 2)).max() * self.mixture.pitch**2
        self.has_weak = bool(total > LEAST_WEAK)
        self.nodes, self.weights = _directions()

    def transport(
        self,
        theta: Real,
        phi: Real,
        wavelength: float,
        model: str,
        index: complex | Filmed | None,
        grid: DirectionGrid | GratingGrid,
        faded: bool = False,
    ) -> Transport:
        """The map at polar angles (t,) and azimuths (p,), rad, from weights on a grid.

        wavelength : nm; model, index : as in `Gain`; faded : whether by `gain.fade`.
        """
        gain = self.gain(wavelength, model, index)
        return self.of_gain(theta, phi, gain, grid, faded)

    def gain(self, wavelength: float, model: str, index: complex | Filmed | None) -> Gain:
        """G of a model and material at a wavelength (nm)."""
        k = float(wavenumber(wavelength))
        return Gain(self.roughness, model, index, k, self.height_scale)

    def of_gain(
        self,
        theta: Real,
        phi: Real,
        gain: Gain,
        grid: DirectionGrid | GratingGrid,
        faded: bool = False,
    ) -> Transport:
        """As `transport`."""

        def rows(theta: Real, phi: Real) -> list[Row]:
            # R = 1 is Kirchhoff's own
            tables = [None] * len(theta) if gain.index is None else gain.tables(theta)
            return [
                _Reflected(self, gain.wavenumber, float(angle), phi, table, faded)
                for angle, table in zip(theta, tables, strict=True)
            ]

        return self.of_rows(rows, theta, phi, grid)

    def of_rows(
        self,
        rows_at: Callable[[Real, Real], Sequence[Row]],
        theta: Real,
        phi: Real,
        grid: DirectionGrid | GratingGrid,
    ) -> Transport:
        """As `transport`, of the rows at polar angles and azimuths."""
        rows = rows_at(theta, phi)
        mirrored = np.array([row.mirrored for row in rows])[:, None]
        return Transport(
            glossy=np.array([row.glossy() for row in rows])[:, None],
            mirror=grid.interpolation(mirrored, phi + math.pi),
            weak=self._weak(rows_at, theta, phi, grid) if self.has_weak else None,
            strong=_strong_of(rows, grid) if len(self.mixture.frequency) else None,
        )

    def _weak(
        self,
        rows_at: Callable[[Real, Real], Sequence[Row]],
        theta: Real,
        phi: Real,
        grid: DirectionGrid | GratingGrid,
    ) -> Weak:
        """The weak orders' part: smooth, so that a grid of half as many angles will do."""
        half = DirectionGrid(20, 30)
        if isinstance(grid, DirectionGrid):
            half = DirectionGrid(min(grid.polar // 2, 24), min(grid.azimuthal // 2, 30))
        x, y, cos_o = self.nodes
        turned = half.phi[:, None] + np.arctan2(y, x)
        return Weak(
            np.stack([row.weak() for row in rows_at(half.theta, half.phi)]),
            grid.interpolation(np.broadcast_to(np.arccos(cos_o), turned.shape), turned),
            half.interpolation(theta[:, None], phi),
        )


@dataclass(frozen=True)
class Weak:
    """Shares (t', p', n) that go to `nodes` (p', n), interpolated to `directions` (t, p)."""

    shares: Array
    nodes: Interpolation
    directions: Interpolation

    def __call__(self, s: Array) -> Array:
        return self.directions(np.einsum("tpn,pn->tp", self.shares, self.nodes(s)))


@dataclass(frozen=True)
class Transport:
    """a = M s: the albedo (t, p) from weights s on the grid of directions.

    Attributes
    ----------
    glossy : (t, 1) share of order 0, which goes to `mirror`.
    weak, strong : the other orders' parts, if any.
    """

    glossy: Real
    mirror: Interpolation
    weak: Weak | None
    strong: Summed | None

    def __call__(self, s: Array) -> Array:
        result = self.glossy * self.mirror(s)
        for part in (self.weak, self.strong):
            if part is not None:
                result = result + part(s)
        return np.asarray(result, np.float32)


def _strong_of(rows: Sequence[Row], grid: DirectionGrid | GratingGrid) -> Summed:
    found = [row.strong() for row in rows]
    shares, theta, phi = (np.stack(part) for part in zip(*found, strict=True))
    return grid.interpolation(theta, phi).summed(shares.astype(np.float32))


class Row(ABC):
    """The sums at one polar angle of incidence and all azimuths.

    k : wavenumber where the light goes to, rad/µm.
    sin : of the angle of incidence, as the light would have it there.
    mirrored : polar angle of order 0.
    sign : of the orders' frequencies.
    """

    sign = 1.0

    def __init__(self, orders: Orders, k: float, sin: float, mirrored: float, phi: Real) -> None:
        self.mixture, self.phi = orders.mixture, phi
        self.k, self.sin, self.mirrored = k, sin, mirrored
        self.nodes, self.weights = orders.nodes, orders.weights
        self.sigma = orders.sigma

    @abstractmethod
    def kappa(self, cos_o: Real) -> Real:
        """κ of light that leaves at cosθo, rad/µm."""

    @abstractmethod
    def gain(self, cos_o: Real, turn: Real) -> Real:
        """G at cosθo and φo − φi."""

    def glossy(self) -> float:
        """Order 0: its power times the mean of G over the visible part of its lobe."""
        k, sin_i = self.k, self.sin
        width = 1.0 / (self.sigma * k)  # in direction cosines
        low, high = max(sin_i - _LOBE * width, 0.0), min(sin_i + _LOBE * width, 1.0)
        if low >= 1.0:
            return 0.0
        # In cosθo instead of sinθo: d(sinθo)/cosθo = d(cosθo)/sinθo has no pole at the horizon
        edges = math.sqrt(1.0 - high**2), math.sqrt(1.0 - low**2)
        if low == 0.0 or edges[1] - edges[0] < 1e-12:
            cosine = np.array([math.cos(self.mirrored)])
            power = self.mixture.order_0(self.kappa(cosine))
            return float(power[0] * self.gain(cosine, np.array([math.pi]))[0])
        nodes = (np.arange(_LOBE_NODES) + 0.5) / _LOBE_NODES
        cos_o = edges[0] + nodes * (edges[1] - edges[0])
        sin_o = np.sqrt(1.0 - cos_o**2)
        radial = np.exp(-(((sin_o - sin_i) / width) ** 2)) / (math.sqrt(math.pi) * width)
        radial *= (edges[1] - edges[0]) / _LOBE_NODES * cos_o / sin_o
        turn = math.pi - np.arcsin(np.clip(width * _HERMITE[0][:, None] / sin_o, -1.0, 1.0))
        mean = _HERMITE[1] @ self.gain(cos_o + 0.0 * turn, turn) / math.sqrt(math.pi)
        power = self.mixture.order_0(self.kappa(cos_o))
        return float(np.sum(radial * power * mean))

    def weak(self) -> Array:
        """Shares (p, n) of the quadrature's directions."""
        mixture, k = self.mixture, self.k
        x, y, cos_o = self.nodes
        gain = self.gain(cos_o, np.arctan2(y, x))
        factor = (k**2 * self.weights * cos_o * gain).astype(np.float32)
        position = np.minimum(self.kappa(cos_o) / mixture.kappa_step, len(mixture.density) - 1.001)
        lower = position.astype(np.int32)
        upper_share = (position - lower).astype(np.float32)
        layer = mixture.density[0].size
        scale = self.sign * k / mixture.pitch
        bx, by = scale * (x + self.sin), scale * y
        sin, cos = np.sin(self.phi)[:, None], np.cos(self.phi)[:, None]
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

    def strong(self) -> tuple[Real, Real, Real]:
        """Shares (p, m) of the strong orders, and their θo and azimuths."""
        mixture, k = self.mixture, self.k
        places = mixture.frequency * (self.sign / k)
        x = places[:, 0] - self.sin * np.cos(self.phi)[:, None]
        y = places[:, 1] - self.sin * np.sin(self.phi)[:, None]
        radius, azimuth = np.hypot(x, y), np.arctan2(y, x)
        share, cos_o, pole = lobe_means(self.sigma, k, radius)
        power = mixture.strong_at(self.kappa(np.sqrt(np.maximum(1.0 - radius**2, 0.0))))
        turn = azimuth - self.phi[:, None]
        gain = self.gain(cos_o, turn)
        near = cos_o * pole > 1.001
        end = np.full(np.count_nonzero(near), LEAST_COSINE)
        at_horizon = self.gain(end, turn[near]) * LEAST_COSINE
        gain[near] = over_lobe(gain[near], at_horizon, cos_o[near], pole[near])
        return power * gain * share, np.arccos(cos_o), azimuth


class _Reflected(Row):
    """Of light that stays above the surface."""

    def __init__(
        self, orders: Orders, k: float, theta: float, phi: Real, table: Real | None, faded: bool
    ) -> None:
        super().__init__(orders, k, math.sin(theta), theta, phi)
        self.cos, self._table, self._faded = math.cos(theta), table, faded

    def kappa(self, cos_o: Real) -> Real:
        return np.asarray(self.k * (self.cos + cos_o))

    def gain(self, cos_o: Real, turn: Real) -> Real:
        """G, faded or not."""
        one_plus_dot = 1.0 + self.cos * cos_o + self.sin * np.sqrt(1.0 - cos_o**2) * np.cos(turn)
        gain = (one_plus_dot / (self.cos + cos_o)) ** 2 / (self.cos * cos_o)
        if self._table is not None:
            gain = gain * read(self._table, cos_o, turn)
        return gain * fade(self.cos, cos_o) if self._faded else gain


def lobe_means(sigma: float, k: float, radius: Real) -> tuple[Real, Real, Real]:
    """The visible share of lobes, and its means of cosθo and of 1/cosθo.

    radius : of their centres from the normal, in direction cosines.
    """
    places, *means = lobes(sigma, k)
    place = np.interp(radius, places, np.arange(float(len(places))))
    low = np.minimum(place.astype(np.int32), len(places) - 2)
    share = place - low
    visible, cosine, pole = (one[low] * (1.0 - share) + one[low + 1] * share for one in means)
    return np.where(radius < places[-1], visible, 0.0), cosine, pole


@lru_cache(maxsize=64)
def lobes(sigma: float, k: float) -> tuple[Real, Real, Real, Real]:
    """Means over a lobe's visible part, against its centre's distance from the normal.

    Returns the distances (direction cosines), the visible share, and of that the mean of cosθo and
    of 1/cosθo.
    """
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


def _directions() -> tuple[tuple[Real, Real, Real], Real]:
    """Quadrature over the hemisphere: (x, y, cosθ) of the nodes and their solid angles."""
    position, share = np.polynomial.legendre.leggauss(RINGS)
    theta = 0.25 * np.pi * (position + 1.0)
    parts: list[list[Real]] = [[], [], [], []]
    for n, (angle, weight) in enumerate(zip(theta, share * 0.25 * np.pi, strict=True)):
        steps = max(8, round(STEPS * math.sin(angle)))
        azimuth = (np.arange(steps) + 0.381966 * n) * (2.0 * np.pi / steps)
        sine = math.sin(angle)
        parts[0].append(sine * np.cos(azimuth))
        parts[1].append(sine * np.sin(azimuth))
        parts[2].append(np.full(steps, math.cos(angle)))
        parts[3].append(np.full(steps, weight * sine * 2.0 * np.pi / steps))
    x, y, cosine, weights = (np.concatenate(part) for part in parts)
    return (x, y, cosine), weights
