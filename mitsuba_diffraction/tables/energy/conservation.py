"""Energy conservation: a scale of directions by which no more is reflected than comes in.

The model f gains energy on some surfaces at some angles. With the albedo a(ω) of f at one
wavelength, s is sought such that

    f'(ωi, ωo) = f(ωi, ωo) s(ωi) s(ωo)   reflects   s(ωi) ∫ f s cosθo dωo = min(a(ωi), 1):

reciprocal, since s s is symmetric, and with nothing taken from directions that gain nothing, since
their s is a little above 1 where that of their partners is below. That is the scaling of a
symmetric kernel to given sums (`scaling`). What is left to do:

- Between the grid's directions and wavelengths an order may appear or vanish (a Rayleigh anomaly).
  So the albedo is looked at between them too, and s lowered around where it is above 1.
- No scaling exists where a direction's partners all gain and it does not: the light between two
  groups of directions, as a blazed grating has them, is one sum for both. There s ends up between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...optics.fresnel import Filmed
from ..table import DiffractionTable
from .gain import fades
from .grid import Array, DirectionalTable, DirectionGrid, Real
from .scaling import lowered, parallel, scaled
from .settings import EnergySettings
from .transport import Orders, Transport

#: n + ik of the material at wavelengths (n,), nm, or that under a film; None for R = 1.
Index = Callable[[Real], "NDArray[np.complex128] | Filmed | None"]


@dataclass(frozen=True)
class Conservation:
    """What a surface reflects, and what is taken of it.

    Attributes
    ----------
    albedo : of the model as it is.
    scale : s, or None where the albedo is at most 1; what Kirchhoff's is scaled from is attenuated
        towards the horizon (`gain.fade`).
    """

    albedo: DirectionalTable
    scale: DirectionalTable | None


def conservation(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    wavelength_range: tuple[float, float],
) -> Conservation:
    """Conserve the energy of a table at one height scale: seconds where energy is gained.

    Parameters
    ----------
    model : "kirchhoff" or "small_slope".
    index : of the material over that of the medium above it.
    wavelength_range : nm; both ends may be one.
    """
    maps = _Maps(Orders(table, height_scale), model, index)
    settings = maps.orders.settings
    coarse = DirectionGrid(settings.coarse_polar, settings.coarse_azimuthal)
    albedo = maps.albedo(coarse, wavelengths_of(wavelength_range, settings.coarse_wavelengths))
    if albedo.values.max() <= settings.threshold:
        return Conservation(albedo, None)
    filmed = isinstance(index(albedo.wavelengths), Filmed)
    count = settings.film_wavelengths if filmed else settings.wavelengths
    return Conservation(albedo, maps.scale(wavelengths_of(wavelength_range, count)))


def wavelengths_of(wavelength_range: tuple[float, float], count: int) -> Real:
    """Wavelengths (nm) evenly in their logarithm, or the only one."""
    low, high = wavelength_range
    return np.geomspace(low, high, count if high > low else 1)


def between(wavelengths: Real) -> Real:
    """Wavelengths amid each two, or the only one."""
    return np.sqrt(wavelengths[1:] * wavelengths[:-1]) if len(wavelengths) > 1 else wavelengths


def albedos(
    table: DiffractionTable,
    height_scale: float,
    model: str,
    index: Index,
    scale: DirectionalTable | None,
    theta: Real,
    phi: Real,
    wavelength: float,
) -> tuple[Array, Array]:
    """Return the albedo as it is and scaled, (t, p) each, at angles (rad) and one wavelength (nm).

    Exact sums at these directions, not the grid's: what a furnace finds. Arguments as in
    `conservation`, which gave the scale.
    """
    maps, at = _Maps(Orders(table, height_scale), model, index), np.array([wavelength])
    grid = _grid(maps.orders.settings) if scale is None else scale.grid
    raw = maps.at(at, theta, phi, grid)[0](grid.ones)
    if scale is None:
        return raw, raw
    transport = maps.at(at, theta, phi, grid, faded=maps.fades)[0]
    return raw, scale.at(theta[:, None], phi, wavelength) * transport(scale.page(wavelength))


def _grid(settings: EnergySettings) -> DirectionGrid:
    return DirectionGrid(settings.polar, settings.azimuthal)


@dataclass(frozen=True)
class _Maps:
    """Maps from weights of directions to albedos."""

    orders: Orders
    model: str
    index: Index

    @property
    def fades(self) -> bool:
        return fades(self.model)

    def at(
        self,
        wavelengths: Real,
        theta: Real,
        phi: Real,
        grid: DirectionGrid,
        *,
        faded: bool = False,
    ) -> list[Transport]:
        """Maps at several wavelengths (nm), for directions, from weights on a grid."""
        indices = self.index(wavelengths)

        def at_wavelength(n: int) -> Transport:
            index = None if indices is None else indices[n]
            gain = self.orders.gain(float(wavelengths[n]), self.model, index)
            return self.orders.transport(theta, phi, gain, grid, faded=faded)

        return parallel(at_wavelength, range(len(wavelengths)))

    def albedo(self, grid: DirectionGrid, wavelengths: Real) -> DirectionalTable:
        """Albedo of the model as it is, on a grid of directions."""
        transports = self.at(wavelengths, grid.theta, grid.phi, grid)
        values = np.stack([transport(grid.ones) for transport in transports])
        return DirectionalTable(wavelengths, values)

    def scale(self, wavelengths: Real) -> DirectionalTable:
        """Find s."""
        settings = self.orders.settings
        grid = _grid(settings)
        largest = np.interp(np.degrees(grid.theta), (70.0, 80.0), (settings.largest, 1.0))

        def at_nodes(each: tuple[Transport, Transport]) -> Array:
            raw, transport = each
            aim = np.minimum(raw(grid.ones), np.float32(settings.target))
            return scaled(transport, aim, largest[:, None], settings.sweeps)

        raw = self.at(wavelengths, grid.theta, grid.phi, grid)
        faded = raw
        if self.fades:
            faded = self.at(wavelengths, grid.theta, grid.phi, grid, faded=True)
        scale = np.stack(parallel(at_nodes, zip(raw, faded, strict=True)))
        del raw, faded
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

        transports = self.at(between(wavelengths), theta, phi, grid, faded=self.fades)
        return DirectionalTable(
            wavelengths, lowered(scale, list(map(excess, transports)), settings)
        )
