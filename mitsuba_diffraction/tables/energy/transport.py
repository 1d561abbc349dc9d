"""Light that a table's orders send on: sums for directions of incidence, at one wavelength (NumPy).

With q = k(ωi + ωo) in the tangent plane, dωo = d²q/(k² cosθo) turns ∫f s cosθo dωo, the albedo with
the light along ωo weighted by s(ωo), into a sum over the orders' lobes,

    a(ωi) = Σ_j ∫ |a_j(κ)|² (σ²/π) exp(−σ²|q − q_j|²) G(ωi, ωo) s(ωo) d²q,

over the frequencies that are visible, with κ = k w times the height scale and G as in `gain`:

- order 0, the mirrored or refracted direction, by quadrature over its lobe, or over all directions
  where the lobe is wide;
- the few *strong* orders, one by one, at several nodes across a lobe that the horizon or a critical
  angle cuts: an order that grazes the horizon (a Rayleigh anomaly) is a spike of the albedo;
- the many *weak* ones as a smooth density, by quadrature over directions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import scipy

from ...arrays import Real, Single
from ...optics.geometry import LAST_ANGLE, wavenumber
from ...optics.lobes import LOBE_END, nodes_across
from ...optics.paths import Path
from ..directional import DirectionGrid, LinearMap, Quadrature, quadrature
from ..order_mixture import NARROW, order_mixture
from ..powers import order_0_power
from ..table import DiffractionTable
from .gain import LEAST_COSINE, PathGain
from .settings import energy_settings

#: The weak orders are smoothed by this share of the distance between rings, at least. Orders that
#: have wider lobes are all in the density: with 0.6 of the distance their sums were 7 % off.
SMOOTHING = 1.0
#: Weak orders of less power in all are left out. Kirchhoff's orders that graze the horizon gain as
#: 1/(cosθi cosθo) in grazing light: a power of 2.5e-5 sent on 0.2 of the light at 89.5°.
LEAST_WEAK, LEAST_GRAZING = 2e-3, 1e-6

#: Width of order 0's lobe, in distances between rings, above which all directions are summed over:
#: G differs from one azimuth to another, by 0.01 under 4 µm. The quadrature resolves such lobes.
_WIDE = 1.15
#: Index above which wide lobes get a finer quadrature: they are narrow within such a dielectric.
#: Light from within at 84° was 0.01 short of the model's at 2.46, and is 0.002 short.
_DENSE = 2.0
#: Angles of incidence from the critical one, rad, that weak orders are summed at.
_NEAR_CRITICAL = np.radians([-1.5, -0.5, 0.0, 0.5, 1.5])
#: Pairs of a direction and an order, or another direction, that are looked at together.
_PAIRS = 1 << 16
#: How often distances between azimuths of incidence are halved, at most.
_MOST_HALVED = 2
_NODES = 96  # in cosθo across order 0
_FINER = 16  # nodes of order 0's power from one κ of the mixture to the next


class ScatteredOrders:
    """Orders of a table at one height scale: order 0, a few strong ones, a density of all others.

    wavelength_range : of the light, nm.
    densest : largest index of the media that light travels in.
    finer : factor on the quadrature's resolution.
    """

    def __init__(
        self,
        table: DiffractionTable,
        wavelength_range: tuple[float, float],
        height_scale: float = 1.0,
        densest: float = 1.0,
        finer: int = 1,
    ) -> None:
        self.sigma, self.sigma_0 = table.sigma, table.sigma_0
        self.roughness, self.height_scale = table.roughness, height_scale
        self.densest, settings = densest, energy_settings()
        longest, shortest = (float(wavenumber(each)) for each in wavelength_range)
        # lobes are narrower in a dense medium: as wide as the mean of both sides takes. Under a
        # window of 4 µm on an index of 2.46 sums were 0.08 off without, and are 0.004 to 0.02
        smoothing = SMOOTHING * longest * math.sqrt(densest) * 0.5 * math.pi / settings.rings
        lobe = 1.0 / (math.sqrt(2.0) * table.sigma)
        if densest > _DENSE and lobe > NARROW * smoothing:
            finer = max(finer, 2)
        self._least_finer, self._finer_per_k = finer, 0.0
        if table.grid.overlapping and lobe >= NARROW * smoothing:  # which smoothing would widen
            self._finer_per_k = smoothing / lobe / longest
        smoothing /= self._finer(longest)
        # κ of light that stays within a dielectric is larger by the index
        scale = height_scale * densest
        reach = min(2.0 * longest, table.q_limit)
        self.mixture = order_mixture(table, scale, reach, smoothing)
        self.strong = len(self.mixture.frequency)
        count = len(self.mixture.central)
        self._kappas = self.mixture.kappa_step * np.linspace(0.0, count - 1, _FINER * count)
        nodes = self.mixture.kappa_step * np.arange(count, dtype=np.float64)
        # none is left where it is among the weak ones, and less in dark speckle
        left = self.mixture.central / np.maximum(order_0_power(table, nodes * scale), 1e-12)
        powers = order_0_power(table, self._kappas * scale)
        self._powers = powers * np.interp(self._kappas, nodes, left)
        # light that interferes with order 0 goes with the root of its power
        weak = self.mixture.weak
        self._weak = weak if self.mixture.beats is None else math.sqrt(weak)
        #: Least w of light let through
        self.least_width = densest * self.mixture.kappa_step / shortest

    @property
    def others(self) -> float:
        """Most light that all orders but 0 have, or 1 where some are strong."""
        return 1.0 if self.strong else self._weak

    def has_weak(self, model: str) -> bool:
        """Whether the weak orders of a model matter."""
        return self._weak > (LEAST_GRAZING if model == "kirchhoff" else LEAST_WEAK)

    def quadrature(self, above: float, critical_sine: float | None = None) -> Quadrature:
        """Return directions for light of a wavenumber above the surface: closer for short waves.

        critical_sine : of an angle on both sides of which directions of y > 0 are.
        """
        settings, finer = energy_settings(), self._finer(above)
        rings, steps = (math.ceil(finer * count) for count in (settings.rings, settings.steps))
        if critical_sine is None:
            return quadrature(rings, steps)
        return quadrature(rings, steps, critical_sine, upper=True)

    def distance(self, above: float) -> float:
        """Return the angle between rings of the quadrature, rad."""
        return 0.5 * math.pi / (self._finer(above) * energy_settings().rings)

    def _finer(self, above: float) -> float:
        """Return the factor on the resolution by which lobes are resolved at a wavenumber."""
        return max(self._least_finer, above * self._finer_per_k)

    def incidence(self, grid: DirectionGrid, k: float) -> DirectionGrid:
        """Return a grid close enough for the weak orders' light of wavenumber k.

        Where lobes are apart, light appears and vanishes over the width of one.
        """
        wanted = 2.0 * math.pi * k / self.mixture.lobe

        def finer(count: int, wanted: float) -> int:
            halved = math.ceil(math.log2(max(wanted / count, 1.0)))
            return int(count * 2 ** min(halved, _MOST_HALVED))

        return DirectionGrid(finer(grid.polar, 0.25 * wanted), finer(grid.azimuthal, wanted))

    def order_0(self, kappa: Real) -> Real:
        """Return the power of order 0 at κ over the height scale and `densest`."""
        return np.interp(kappa, self._kappas, self._powers)


class Transport:
    """Light of one wavelength on one path, from directions (t, p), for weights on a grid.

    Parameters
    ----------
    orders, path : of the surface and the light.
    wavelength : nm.
    theta, phi : polar angles (t,) and azimuths (p,) of incidence, rad.
    grid : of the weights on the side that light goes to.
    """

    def __init__(
        self,
        orders: ScatteredOrders,
        path: Path,
        wavelength: float,
        theta: Real,
        phi: Real,
        grid: DirectionGrid,
    ) -> None:
        self._orders, self._path = orders, path
        self.came, self.left = path.came.number, path.left.number
        self._above = above = float(wavenumber(wavelength))
        self._gain = PathGain(path, orders.roughness, above, orders.height_scale)
        self._mirrored = partial(path.mirrored, k=above, sigma_0=orders.sigma_0)
        self._k = above * path.left.index  # where the light goes to
        self._per_w = above / orders.densest
        self._width = 1.0 / (orders.sigma * self._k)  # of a lobe, in direction cosines
        self._width_0 = 1.0 / (orders.sigma_0 * self._k)  # of order 0's
        self._parts: list[Callable[[Single], Single]] = [self._order_0(theta, phi, grid)]
        if orders.has_weak(path.model):
            self._parts.append(self._weak_towards(theta, phi, grid))
        if orders.strong:
            self._parts.append(self._strong(theta, phi, grid))

    def __call__(self, s: Single) -> Single:
        """Return the light of all orders for weights on the grid, (t, p)."""
        return np.asarray(sum(part(s) for part in self._parts), np.float32)

    def _start(self, theta: Real) -> tuple[Real, Real]:
        """Return cosines of incidence, and sines of the mirrored or refracted directions."""
        sine = np.sin(theta) * (self._path.came.index / self._path.left.index)
        return np.maximum(np.cos(theta), LEAST_COSINE), sine

    def _kappa(self, cos_i: Real, cos_o: Real) -> Real:
        """Return κ over the height scale and `ScatteredOrders.densest`."""
        return self._per_w * np.maximum(self._path.width(cos_i, cos_o), self._path.least)

    def _order_0(self, theta: Real, phi: Real, grid: DirectionGrid) -> Callable[[Single], Single]:
        """Return the map from weights on a grid to the light of order 0."""
        if self._width_0 > _WIDE * self._orders.distance(self._above):
            return self._order_0_everywhere(theta, phi, grid)
        shares = self._order_0_shares(theta, grid)
        mirrored = grid.interpolation(grid.theta[:, None], phi + math.pi)
        return lambda s: np.asarray(shares @ mirrored(s), np.float32)

    def _order_0_everywhere(
        self, theta: Real, phi: Real, grid: DirectionGrid
    ) -> Callable[[Single], Single]:
        """Return the map from weights on a grid to order 0, which goes to all directions."""
        nodes = self._orders.quadrature(self._above, self._path.left.critical_sine)
        shares = np.concatenate(
            [self._order_0_at(theta[rows], nodes) for rows in _blocks(len(theta), len(nodes.x))]
        )
        turns = grid.turns(phi)
        # the lobe of light that comes in the plane y = 0 is symmetric about this plane
        kernels = [
            (turned, shares @ sum(grid.interpolation(nodes.theta, offset + side).matrix
                                  for side in (nodes.azimuth, -nodes.azimuth)))
            for offset, turned in turns.offsets
        ]  # fmt: skip

        def light(s: Single) -> Single:
            found, pages = np.empty((len(theta), len(phi)), np.float32), turns.seen(s)
            for turned, kernel in kernels:
                found[:, turned] = kernel @ pages[turned].T
            return found

        return light

    def _order_0_at(self, theta: Real, nodes: Quadrature) -> Single:
        """Return shares (t, n) of order 0 that go to the quadrature's directions in its lobe."""
        cosines, sine = self._start(theta[:, None])
        squared = ((nodes.x + sine) ** 2 + nodes.y**2) / self._width_0**2
        shares = np.zeros(squared.shape, np.float32)
        row, node = within = np.nonzero(squared < LOBE_END**2)
        cos_i, cos_o, path = cosines[row, 0], nodes.cosine[node], self._path
        lobe = np.exp(-squared[within]) / (math.pi * self._width_0**2) * cos_o * nodes.weights[node]
        power = self._orders.order_0(self._per_w * path.width(cos_i, cos_o))
        gain, face = self._mirrored(cos_i, cos_o, np.cos(nodes.azimuth[node]))
        shares[within] = lobe * (gain * power + face)
        return shares

    def _order_0_shares(self, theta: Real, grid: DirectionGrid) -> Real:
        """Return shares (t, rows) of order 0 that go to the polar angles of a grid.

        The distance of a Gaussian lobe's directions from the normal has Rice's distribution. In
        cosθo, since d(sinθo)/cosθo = d(cosθo)/sinθo has no pole at the horizon.
        """
        cos_i, sine, width, path = *self._start(theta[:, None]), self._width_0, self._path
        # light within the critical angle goes into that cone, and light beyond stays outside
        edge = path.left.critical_sine
        ends = np.where(sine > edge, edge, 0.0), np.where(sine > edge, 1.0, edge)
        low = np.clip(sine - LOBE_END * width, *ends)
        high = np.clip(sine + LOBE_END * width, *ends)
        first, last = np.sqrt(1.0 - high**2), np.sqrt(1.0 - low**2)
        place = (np.arange(_NODES) + 0.5) / _NODES
        # denser towards both ends, where C may have a root's slope; where a lobe has no directions
        # on this side the step is 0, and so are the shares
        cos_o = np.maximum(first + (last - first) * place**2 * (3.0 - 2.0 * place), 1e-9)
        step = (last - first) * 6.0 * place * (1.0 - place) / _NODES
        sin_o = np.sqrt(1.0 - cos_o**2)
        parts = np.exp(-(((sin_o - sine) / width) ** 2)) * 2.0 * step / width**2 * cos_o
        parts *= scipy.special.i0e(2.0 * sin_o * sine / width**2)
        power = self._orders.order_0(self._per_w * path.width(cos_i, cos_o))
        gain, face = self._mirrored(cos_i, cos_o, -1.0)
        parts *= gain * power + face
        to_rows = DirectionGrid(grid.polar, 1).interpolation(np.arccos(cos_o), 0.0)
        return to_rows.summed(np.asarray(parts, np.float32)).matrix.toarray()

    def _weak_towards(
        self, theta: Real, phi: Real, grid: DirectionGrid
    ) -> Callable[[Single], Single]:
        """Return the map from weights on a grid to the weak orders' light.

        The light is summed at directions of half the grid, about the critical angle, where it has
        a cusp, and beyond the grid. The light may grow as 1/cosθ: times cosθ it is linear between.
        """
        half = self._orders.incidence(grid.half, self._k)
        near = math.asin(self._path.critical_sine) + _NEAR_CRITICAL
        between = near[(near > 0.0) & (near < LAST_ANGLE) & (self._path.critical_sine < 1.0)]
        nodes = np.unique(np.concatenate([half.theta, between, theta[theta > LAST_ANGLE]]))
        weak = self._weak(nodes, half.phi, grid)
        row = np.interp(theta, nodes, np.arange(len(nodes)))
        column = np.mod(phi, 2.0 * math.pi) * (half.azimuthal / (2.0 * math.pi))
        i, j = np.minimum(row.astype(int), len(nodes) - 2), column.astype(int)
        u, v = (row - i).astype(np.float32)[:, None], (column - j).astype(np.float32)
        left, right = j % half.azimuthal, (j + 1) % half.azimuthal

        projected = np.cos(nodes).astype(np.float32)[:, None]
        per_area = np.cos(theta).astype(np.float32)[:, None]

        def light(s: Single) -> Single:
            seen = weak(s) * projected
            across = seen[:, left] * (1.0 - v) + seen[:, right] * v
            return np.asarray((across[i] * (1.0 - u) + across[i + 1] * u) / per_area)

        return light

    def _weak(self, theta: Real, phi: Real, grid: DirectionGrid) -> Callable[[Single], Single]:
        """Return the map from weights on a grid to the weak orders' light from directions (t, p).

        Sums over the quadrature become sums over the grid, as seen from each azimuth.
        """
        nodes, turns = self._orders.quadrature(self._above), grid.turns(phi)
        shape = len(theta), grid.ones.size
        kernels = []
        for offset, turned in turns.offsets:
            to_nodes = grid.interpolation(nodes.theta, nodes.azimuth + offset).matrix
            kernel = np.empty((len(turned), *shape), np.float32)
            kernels.append((turned, to_nodes.T.tocsr(), kernel))
        for rows in _blocks(len(theta), len(nodes.x)):
            pages = self._weak_pages(theta[rows], phi)
            for n, shares in zip(range(*rows.indices(len(theta))), pages, strict=True):
                for turned, to_grid, kernel in kernels:
                    kernel[:, n] = (to_grid @ shares[turned].T).T

        def light(s: Single) -> Single:
            found, seen = np.empty((len(phi), len(theta)), np.float32), turns.seen(s)
            for turned, _, kernel in kernels:
                found[turned] = (kernel @ seen[turned, :, None])[..., 0]
            return found.T

        return light

    def _weak_pages(self, theta: Real, phi: Real) -> Iterator[Single]:
        """Yield for each polar angle the shares (p, n) of the quadrature's directions.

        A page at a time stays in a processor's cache.
        """
        mixture, k = self._orders.mixture, self._k
        nodes = self._orders.quadrature(self._above)
        cos_i, sine = self._start(theta[:, None])
        rows_of = np.arange(len(theta))[:, None]
        gain = self._gain(cos_i[:, 0], rows_of, nodes.cosine, nodes.azimuth)
        position = np.minimum(
            self._kappa(cos_i, nodes.cosine) / mixture.kappa_step, len(mixture.density) - 1.001
        )
        densities = [(mixture.density, gain * (position * mixture.kappa_step) ** 2)]
        if mixture.beats is not None:
            zeroth, _ = self._mirrored(cos_i, nodes.cosine, np.cos(nodes.azimuth))
            densities.append((mixture.beats, np.sqrt(gain * zeroth)))
        lower = position.astype(np.int32)
        upper_share = (position - lower).astype(np.float32)
        scale = self._path.sign(cos_i, nodes.cosine) * (k / mixture.pitch)
        rows, columns = mixture.density.shape[1:]
        # places among thousands need no double precision, which takes six times as long
        x, y, turn = (
            part.astype(np.float32) for part in (scale * (nodes.x + sine), scale * nodes.y, phi)
        )
        sin, cos = np.sin(turn)[:, None], np.cos(turn)[:, None]
        middle_x, middle_y = np.float32(0.5 * columns), np.float32(0.5 * rows)
        factors = []
        for density, gain in densities:
            factor = (k**2 * nodes.weights * nodes.cosine * gain).astype(np.float32)
            factors.append((density.ravel(), factor * (1.0 - upper_share), factor * upper_share))
        for n in range(len(theta)):
            column = (cos * x[n] - sin * y[n] + middle_x).astype(np.int32)
            row = (sin * x[n] + cos * y[n] + middle_y).astype(np.int32)
            np.clip(column, 0, columns - 1, out=column)
            np.clip(row, 0, rows - 1, out=row)
            index = (lower[n] * rows + row) * columns + column
            page = np.zeros(index.shape, np.float32)
            for flat, of_lower, of_upper in factors:
                page += flat.take(index) * of_lower[n]
                page += flat.take(index + rows * columns) * of_upper[n]
            yield page

    def _strong(self, theta: Real, phi: Real, grid: DirectionGrid) -> Callable[[Single], Single]:
        """Return the map from weights on a grid to the light of the strong orders."""
        width = len(phi) * self._orders.strong * len(self._path.signs)
        parts = [self._strong_part(theta[rows], phi, grid) for rows in _blocks(len(theta), width)]
        return lambda s: np.concatenate([part(s) for part in parts])

    def _strong_part(self, theta: Real, phi: Real, grid: DirectionGrid) -> LinearMap:
        """Return the part of `_strong` for some polar angles: pairs that a processor's cache holds.

        Of the pairs of a direction and an order, those below the horizon are left out at once.
        """
        mixture, signs = self._orders.mixture, np.array(self._path.signs)
        cosines, sine = self._start(theta[:, None, None])
        places = np.concatenate([mixture.frequency * (sign / self._k) for sign in signs])
        x = places[:, 0] - sine * np.cos(phi)[:, None]
        y = places[:, 1] - sine * np.sin(phi)[:, None]
        square = x * x + y * y
        pairs = square < (1.0 + LOBE_END * self._width) ** 2
        row, column, order = np.nonzero(pairs)
        radius, azimuth = np.sqrt(square[pairs]), np.arctan2(y[pairs], x[pairs])
        edge = self._path.left.critical_sine
        which, cos_o, visible = nodes_across(self._width, radius, LEAST_COSINE, edge)
        cosines = cosines.ravel()
        sign, order = signs[order // self._orders.strong], order % self._orders.strong
        if len(signs) > 1:
            seen = self._path.sign(cosines[row[which]], cos_o) == sign[which]
            which, cos_o, visible = which[seen], cos_o[seen], visible[seen]
        row, order, azimuth = row[which], order[which], azimuth[which]
        kappa = self._kappa(cosines[row], cos_o)
        gain = self._gain(cosines, row, cos_o, azimuth - phi[column[which]])
        shares = (mixture.strong_at(kappa, order) * gain * visible).astype(np.float32)
        to_orders = grid.interpolation(np.arccos(cos_o), azimuth)
        counts = np.bincount(row * len(phi) + column[which], minlength=len(theta) * len(phi))
        return to_orders.summed_in(counts.reshape(len(theta), len(phi)), shares)


def _blocks(count: int, width: int) -> list[slice]:
    """Slices of rows of a width: pairs that are looked at together."""
    rows = max(1, _PAIRS // width)
    return [slice(first, first + rows) for first in range(0, count, rows)]
