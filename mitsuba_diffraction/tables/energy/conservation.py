"""Energy conservation: scales of directions by which no more light is sent on than comes in.

A reflector gains energy at some angles. With the albedo a(ω) of the model f at one wavelength, s is
sought such that

    f'(ωi, ωo) = f(ωi, ωo) s(ωi) s(ωo)   reflects   s(ωi) ∫ f s cosθo dωo = min(a(ωi), 1):

reciprocal, since s s is symmetric, and with nothing taken from directions that gain nothing, since
their s is a little above 1 where that of their partners is below. That is the scaling of a
symmetric kernel to given sums (`scaling`). What is left to do:

- Between the grid's directions and wavelengths an order may appear or vanish (a Rayleigh anomaly).
  So the albedo is looked at between them too, and s lowered around where it is above 1.
- No scaling exists where a direction's partners all gain and it does not: the light between two
  groups of directions, as a blazed grating has them, is one sum for both. There s ends up between.

A lossless dielectric that lets light through sends all light on. What the first order in the
heights gains or lacks is order 0's: other orders are right to second order in the heights, and
order 0, ∝ |a_0|² alone, is not. So c is sought, on the directions of both sides stacked, such that
with f = f_0 + f_others

    f'(ωi, ωo) = f_others + f_0 c(ωi) c(ωo)   sends on   R + T = 1.

A sheet loses the light beyond its critical angle; c puts that back likewise. Where order 0 has too
little light to make up for what is missing, that stays missing. Where the other orders of a steep
surface exceed 1 on their own, all light is scaled by s(ωi) s(ωo) with s at most 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import median_filter

from ..table import DiffractionTable
from .grid import Array, DirectionalTable, DirectionGrid, LinearMap, Real
from .materials import Dielectric, Reflector
from .scaling import amid, lowered, parallel, scaled
from .settings import energy_settings
from .transport import Orders, Transport

#: Where order 0 has less of the light, it is not scaled.
FAINT = 1e-4


@dataclass(frozen=True)
class Conservation:
    """Albedo of a model, and scales of directions that conserve energy, None where they are 1.

    Attributes
    ----------
    albedo : of a reflector as it is, a.
    scale, scale_below : of all light, s, of directions above and below the surface.
    order_0, order_0_below : of order 0 of a dielectric, c, likewise.
    """

    albedo: DirectionalTable | None = None
    scale: DirectionalTable | None = None
    scale_below: DirectionalTable | None = None
    order_0: DirectionalTable | None = None
    order_0_below: DirectionalTable | None = None


@dataclass(frozen=True)
class Light:
    """Light of one wavelength that a surface sends on from directions (t, p) of each side.

    Sums have the shape (sides, t, p), weights (sides, polar + 1, azimuthal).

    Attributes
    ----------
    paths : of the light.
    here : interpolation from the grid of the weights to the directions.
    """

    paths: list[Transport]
    here: LinearMap

    def order_0(self, weights: Array) -> Array:
        """Return the sums of order 0."""
        return self._sum(lambda path: path.order_0(weights[path.left]))

    def others(self, weights: Array | None = None) -> Array:
        """Return the sums of all other orders; weights : None for 1."""
        if weights is None:
            return self._sum(lambda path: path.unweighted_others)
        return self._sum(lambda path: path.others(weights[path.left]))

    def __call__(self, weights: Array) -> Array:
        """Return the sums of all orders."""
        return self.others(weights) + self.order_0(weights)

    def at_directions(self, weights: Array) -> Array:
        """Interpolate weights to the directions, (sides, t, p)."""
        return np.stack([self.here(side) for side in weights])

    def _sum(self, sent: Callable[[Transport], Array]) -> Array:
        sums = np.zeros((1 + self.paths[-1].came, *self.here.shape), np.float32)
        for path in self.paths:
            sums[path.came] += sent(path)
        return sums


class Surface:
    """A table's surface of a material at one height scale."""

    def __init__(
        self,
        table: DiffractionTable,
        material: Reflector | Dielectric,
        height_scale: float = 1.0,
    ) -> None:
        self._settings, self.material = energy_settings(), material
        self.orders = Orders(table, height_scale, material.densest)
        polar = self._settings.side_polar if material.transmits else self._settings.polar
        self._grid = DirectionGrid(polar, self._settings.azimuthal)

    def conservation(self, wavelength_range: tuple[float, float]) -> Conservation:
        """Conserve energy over a range of wavelengths (nm), whose ends may be one: seconds."""
        if self.material.transmits:
            return self._balanced(wavelength_range)
        settings, coarse = self._settings, self._grid.half
        wavelengths = spread(wavelength_range, max(4, settings.wavelengths // 4))
        lights = self._lights(wavelengths, coarse.theta, coarse.phi, coarse)
        albedos = np.stack([light(coarse.ones[None])[0] for light in lights])
        albedo = DirectionalTable(wavelengths, albedos)
        if albedos.max() <= settings.threshold:
            return Conservation(albedo)
        wavelengths = spread(wavelength_range, settings.wavelengths)
        return Conservation(albedo, DirectionalTable(wavelengths, self._scale(wavelengths)))

    def albedos(
        self, conservation: Conservation, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Array, Array]:
        """Return the light sent on as it is and conserved, (sides, t, p) each, at angles (rad).

        Exact sums at these directions and a wavelength (nm), not the grid's, as a furnace measures
        them. Where the light of a dielectric is attenuated they are bounds: s(ωo) counts as 1.
        """
        grid, transmits = self._grid, self.material.transmits
        light = self._lights(np.array([wavelength]), theta, phi, grid, not transmits)[0]
        sides = 2 if transmits else 1
        ones = np.stack([grid.ones] * sides)

        def page(*tables: DirectionalTable | None) -> Array:
            pages = [grid.ones if t is None else t.page(wavelength) for t in tables[:sides]]
            return np.stack(pages)

        c = page(conservation.order_0, conservation.order_0_below)
        s = page(conservation.scale, conservation.scale_below)
        others = light.others(None if transmits else s)
        raw = light.others() + light.order_0(ones)
        balanced = others + light.at_directions(c) * light.order_0(c * (1 if transmits else s))
        return raw, light.at_directions(s) * balanced

    def _lights(
        self,
        wavelengths: Real,
        theta: Real,
        phi: Real,
        grid: DirectionGrid,
        weighted: bool = True,
    ) -> list[Light]:
        """Light from polar angles (t,) and azimuths (p,), rad, at wavelengths (nm).

        weighted : whether orders other than 0 may have weights other than 1.
        """
        here = grid.interpolation(theta[:, None], phi)
        paths = self.material.paths(wavelengths, self.orders.least_width)

        def at_wavelength(n: int) -> Light:
            wave, directions = float(wavelengths[n]), (theta, phi, grid)
            transports = [Transport(self.orders, p, wave, *directions, weighted) for p in paths[n]]
            return Light(transports, here)

        return parallel(at_wavelength, range(len(wavelengths)))

    def _scale(self, wavelengths: Real) -> Array:
        """Find s at its nodes, and lower it for what lies between."""
        settings, grid = self._settings, self._grid
        # part of a lobe is below the horizon there, and would ask for any s
        largest = np.interp(np.degrees(grid.theta), (70.0, 80.0), (settings.largest, 1.0))

        def at_nodes(light: Light) -> Array:
            aim = np.minimum(light(grid.ones[None]), np.float32(settings.target))
            return scaled(light, aim, largest[:, None], settings.sweeps)

        lights = self._lights(wavelengths, grid.theta, grid.phi, grid)
        scale = np.stack(parallel(at_nodes, lights))
        few = self.orders.strong <= settings.few_orders
        middles = grid.middles(settings.few_parts if few else settings.parts)

        def excess(light: Light, s: Array) -> Array:
            return light.at_directions(s) * light(s) / settings.ceiling

        lights = self._lights(between(wavelengths), *middles, grid)
        scale = lowered(scale, [partial(excess, light) for light in lights], settings)
        return scale[:, 0]

    def _balanced(self, wavelength_range: tuple[float, float]) -> Conservation:
        """Find c above and below, then s if any is less than 1."""
        grid, settings = self._grid, self._settings
        wavelengths = spread(wavelength_range, settings.side_wavelengths)
        ones, most = np.stack([grid.ones] * 2), settings.largest**2

        def at_nodes(light: Light) -> Array:
            others, zeroth = light.others(), light.order_0(ones)
            if np.abs(others + zeroth - 1.0).max() < settings.close:
                return ones
            aim = np.clip(1.0 - others, zeroth / most, zeroth * most)
            c = scaled(light.order_0, aim, settings.largest, settings.sweeps)
            c = np.where(zeroth > FAINT, c, np.float32(1.0))
            # what lies within one row, as a lobe at the critical angle, is left to itself
            return np.asarray(median_filter(c, (1, 3, 1), mode="nearest"))

        lights = self._lights(wavelengths, grid.theta, grid.phi, grid, weighted=False)
        c = np.stack(parallel(at_nodes, lights))
        if np.all(c == 1.0):
            return Conservation()
        middles = self._lights(between(wavelengths), *grid.middles(1), grid, weighted=False)

        def order_0(light: Light, c: Array) -> Array:
            return light.at_directions(c) * light.order_0(c)

        def order_0_excess(light: Light, c: Array) -> Array:
            room, zeroth = settings.ceiling - light.others(), order_0(light, c)
            factor = np.minimum(zeroth / np.maximum(room, 1e-6), most)
            return np.where(zeroth > FAINT, factor, 1.0).astype(np.float32)

        c = lowered(c, [partial(order_0_excess, light) for light in middles], settings)
        totals = [
            light.others() + order_0(light, page)
            for light, page in zip(middles, amid(c), strict=True)
        ]

        def table(scale: Array, side: int) -> DirectionalTable:
            return DirectionalTable(wavelengths, scale[:, side])

        order_0_scales = {"order_0": table(c, 0), "order_0_below": table(c, 1)}
        if max(total.max() for total in totals) <= settings.tolerated:
            return Conservation(**order_0_scales)

        def excess(light: Light, total: Array, s: Array) -> Array:
            # light sent on is attenuated as well: a bound
            return light.at_directions(s) * total / settings.ceiling

        each = [partial(excess, *pair) for pair in zip(middles, totals, strict=True)]
        s = lowered(np.ones_like(c), each, settings)
        return Conservation(scale=table(s, 0), scale_below=table(s, 1), **order_0_scales)


def spread(wavelength_range: tuple[float, float], count: int) -> Real:
    """Wavelengths (nm) evenly in their logarithm, or the only one."""
    low, high = wavelength_range
    return np.geomspace(low, high, count if high > low else 1)


def between(wavelengths: Real) -> Real:
    """Wavelengths amid each two, or the only one."""
    return np.sqrt(wavelengths[1:] * wavelengths[:-1]) if len(wavelengths) > 1 else wavelengths
