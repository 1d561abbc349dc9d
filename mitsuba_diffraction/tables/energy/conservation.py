"""Energy conservation: a scale of directions by which no more is reflected than comes in.

The model f gains energy on some surfaces at some angles. With the albedo a(ω) of f at one
wavelength, e is sought such that

    f'(ωi, ωo) = f(ωi, ωo) e(ωi) e(ωo)   reflects   e(ωi) ∫ f e cosθo dωo = min(a(ωi), 1):

reciprocal, since e e is symmetric, and with nothing taken from directions that gain nothing, since
their e is a little above 1 where that of their partners is below. That is the scaling of a
symmetric kernel to given sums (`scaling`). What is left to do:

- Between the grid's directions and wavelengths an order may appear or vanish (a Rayleigh anomaly).
  So the albedo is looked at between them too, and e lowered around where it is above 1.
- No scaling exists where a direction's partners all gain and it does not: the light between two
  groups of directions, as a blazed grating has them, is one sum for both. There e ends up between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics.fresnel import Filmed
from .gain import Boundary
from .grid import Array, DirectionalTable, DirectionGrid, Real
from .scaling import lowered, parallel, scaled
from .transport import Orders, Transport

#: n + ik of the material at wavelengths (n,), nm, or that under a film; None for R = 1.
Index = Callable[[Real], "NDArray[np.complex128] | Filmed | None"]


@dataclass(frozen=True)
class Conservation:
    """Albedo of the model as it is, and the scale e; None where the albedo is at most 1."""

    albedo: DirectionalTable
    scale: DirectionalTable | None


@dataclass(frozen=True)
class Surface:
    """Orders of a table at one height scale, made of a material.

    Attributes
    ----------
    orders : of the table.
    model : one of `optics.boundary.MODELS`.
    index : of the material over that of the medium above it.
    """

    orders: Orders
    model: str
    index: Index

    def conservation(self, wavelength_range: tuple[float, float]) -> Conservation:
        """Conserve energy over a range of wavelengths (nm), whose ends may be one: seconds."""
        settings = self.orders.settings
        coarse = self._grid.half
        wavelengths = wavelengths_of(wavelength_range, max(4, settings.wavelengths // 4))
        transports = self.transports(wavelengths, coarse.theta, coarse.phi, coarse)
        values = np.stack([transport(coarse.ones) for transport in transports])
        albedo = DirectionalTable(wavelengths, values)
        if values.max() <= settings.threshold:
            return Conservation(albedo, None)
        scale = self._scale(wavelengths_of(wavelength_range, settings.wavelengths))
        return Conservation(albedo, scale)

    def albedos(
        self, scale: DirectionalTable | None, theta: Real, phi: Real, wavelength: float
    ) -> tuple[Array, Array]:
        """Return the albedo as it is and scaled, (t, p) each, at angles (rad).

        Exact sums at these directions and a wavelength (nm), as a furnace finds them.
        """
        grid = self._grid if scale is None else scale.grid
        transport = self.transports(np.array([wavelength]), theta, phi, grid)[0]
        raw = transport(grid.ones)
        if scale is None:
            return raw, raw
        return raw, scale.at(theta[:, None], phi, wavelength) * transport(scale.page(wavelength))

    def transports(
        self, wavelengths: Real, theta: Real, phi: Real, grid: DirectionGrid
    ) -> list[Transport]:
        """Maps from weights on a grid to albedos at directions, for several wavelengths (nm)."""
        indices = self.index(wavelengths)

        def at_wavelength(n: int) -> Transport:
            surface = Boundary(None if indices is None else indices[n], self.model)
            gain = self.orders.gain(float(wavelengths[n]), surface)
            return self.orders.transport(theta, phi, gain, grid)

        return parallel(at_wavelength, range(len(wavelengths)))

    @property
    def _grid(self) -> DirectionGrid:
        return DirectionGrid(self.orders.settings.polar, self.orders.settings.azimuthal)

    def _scale(self, wavelengths: Real) -> DirectionalTable:
        """Find s at its nodes, and lower it for what lies between."""
        settings, grid = self.orders.settings, self._grid
        # part of a lobe is below the horizon there, and would ask for any s
        largest = np.interp(np.degrees(grid.theta), (70.0, 80.0), (settings.largest, 1.0))

        def at_nodes(transport: Transport) -> Array:
            aim = np.minimum(transport(grid.ones), np.float32(settings.target))
            return scaled(transport, aim, largest[:, None], settings.sweeps)

        transports = self.transports(wavelengths, grid.theta, grid.phi, grid)
        scale = np.stack(parallel(at_nodes, transports))
        few = len(self.orders.mixture.frequency) <= settings.few_orders
        parts = settings.few_parts if few else settings.parts
        theta, phi = grid.middles(parts)
        here = grid.interpolation(theta[:, None], phi)

        def excess(transport: Transport) -> Callable[[Array], Array]:
            def of_page(s: Array) -> Array:
                albedo = here(s) * transport(s) / settings.ceiling
                cells = albedo.reshape(grid.polar, parts, grid.azimuthal, parts)
                return np.maximum(cells.max(axis=(1, 3)), np.float32(1.0))

            return of_page

        transports = self.transports(between(wavelengths), theta, phi, grid)
        scale = lowered(scale, [excess(transport) for transport in transports], settings)
        return DirectionalTable(wavelengths, scale)


def wavelengths_of(wavelength_range: tuple[float, float], count: int) -> Real:
    """Wavelengths (nm) evenly in their logarithm, or the only one."""
    low, high = wavelength_range
    return np.geomspace(low, high, count if high > low else 1)


def between(wavelengths: Real) -> Real:
    """Wavelengths amid each two, or the only one."""
    return np.sqrt(wavelengths[1:] * wavelengths[:-1]) if len(wavelengths) > 1 else wavelengths
