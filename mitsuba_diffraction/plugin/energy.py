"""Energy conservation, and the light that goes beneath (Dr.Jit): `tables.energy` in a kernel.

Reflected power is multiplied by s(ωi) s(ωo), reciprocal, where the model's albedo exceeds 1, and
T = 1 − a(ω) of a dielectric's own albedo a reaches a nested BSDF. Where light goes through, order 0
is multiplied by c(ωi) c(ωo), by which reflected and transmitted light add up to 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from ..optics import fresnel
from ..optics.stack import Stacked
from ..tables.directional import FINE, DirectionalTable
from ..tables.energy import conserved
from ..tables.energy.conservation import Conservation, Energy
from ..tables.table import DiffractionTable
from .arithmetic import plain
from .boundary import Boundary
from .direction_lookup import DirectionLookup, at_horizon, between, scales_of
from .directions import Site
from .energy_factors import ScaleRange
from .materials import Dielectric, Material
from .types import Colour, Vector3f

#: Indices are rounded to these, real and imaginary part, so that an optimisation of them waits
#: rarely and sees s, c and the ratio of albedos as constants.
INDEX_STEP, COAT_STEP, DIELECTRIC_STEP = 0.05, 0.01, 0.01
#: Largest change of a film's fringe by rounding its index, rad: at grazing angles light that a film
#: guides gains several times, within narrow fringes.
FILM_PHASE = 0.02
#: Largest ratio of a film's albedo to that of the flat one.
MOST_RATIO = 2.0

#: Part of a `Conservation` that a look-up shows; None where it is 1 everywhere.
TableOf = Callable[[Conservation], DirectionalTable | None]


class EnergyModel:
    """Conserved energy of a BSDF, tabulated for the parameters last set.

    Parameters
    ----------
    table : of the BSDF, the mean over all positions of the window.
    wavelength : nm, for mono variants.
    """

    def __init__(self, table: DiffractionTable, wavelength: float) -> None:
        self._table = table
        mono = wavelength, wavelength
        self._range = mono if mi.is_monochromatic else table.wavelength_range

    def material(self, factors: ScaleRange) -> conserved.Reflector | conserved.Dielectric:
        """Return the material whose energy is conserved."""
        raise NotImplementedError

    def lookups(self) -> Iterator[tuple[DirectionLookup, TableOf]]:
        """Yield the look-ups, and the part of a `Conservation` that each shows."""
        raise NotImplementedError

    def update(self, factors: ScaleRange) -> None:
        """Look up, or compute, what belongs to other factors or another material.

        Values are linear between height scales, 1 among them. At a height scale their derivative
        is taken from the interval above.
        """
        self._factors, wavelengths = factors, factors.wavelengths(self._range)
        self._energy = Energy(self._table, self.material(factors), wavelengths, factors.least)
        lookups = list(self.lookups())
        nodes = factors.nodes(self._energy) if lookups else []
        energies = [self._energy.at(node) for node in nodes]
        for lookup, table_of in lookups:
            lookup.update(scales_of([table_of(energy) for energy in energies]), nodes, factors)

    def tabulated(self, table_of: TableOf, height_scale: float) -> DirectionalTable | None:
        """Return the table that a look-up shows, for shaders; None where all values are 1."""
        centre = self._factors.centre
        height_scale /= centre
        nodes = self._energy.nodes(height_scale)
        tables = scales_of([table_of(self._energy.at(node)) for node in nodes])
        if tables is None:
            return None
        table = between(tables, nodes, height_scale)
        return DirectionalTable(table.wavelengths * centre, table.values)


class ReflectedEnergy(EnergyModel):
    """Scale s and albedo of a surface that reflects.

    Parameters
    ----------
    boundary : of the BSDF; coat : the clear layer over the structure, or None.
    conserving : whether excess is removed.
    beneath : whether light that is not reflected goes on to a nested BSDF, by the albedo.
    """

    def __init__(
        self,
        table: DiffractionTable,
        wavelength: float,
        boundary: Boundary,
        coat: Dielectric | None,
        conserving: bool,
        beneath: bool,
    ) -> None:
        super().__init__(table, wavelength)
        self._model, self._material, self._coat = boundary.model.name, boundary.material, coat
        self.conserving, self.beneath = conserving, beneath
        self._scale, self._ratio = DirectionLookup(), DirectionLookup()

    def material(self, factors: ScaleRange) -> conserved.Reflector:
        """See `EnergyModel.material`."""
        # of the material alone: a reference to this object would be a cycle, and keep the table
        self._indices = partial(_rounded_indices, self._material, factors.centre, self._range)
        coat = 1.0 if self._coat is None else float(rounded_index(plain(self._coat.eta), COAT_STEP))
        return conserved.Reflector(self._model, self._indices, coat)

    def lookups(self) -> Iterator[tuple[DirectionLookup, TableOf]]:
        """See `EnergyModel.lookups`."""
        if self.conserving:
            yield self._scale, lambda energy: energy.scale
        if self.beneath:
            yield self._ratio, self._ratio_of

    def scale(self, height_scale: float) -> DirectionalTable | None:
        """Return s on `FINE`, for shaders; None where it is 1."""

        def fine(energy: Conservation) -> DirectionalTable | None:
            return None if energy.scale is None else energy.scale.on(FINE)

        return self.tabulated(fine, height_scale) if self.conserving else None

    def ratio(self, height_scale: float) -> DirectionalTable | None:
        """Return the table of `reflected`, for shaders; None where it is 1."""
        return self.tabulated(self._ratio_of, height_scale) if self.beneath else None

    @property
    def scales(self) -> bool:
        """Whether the BSDF is multiplied by a scale."""
        return self._scale.present

    def factor(self, site: Site, wo: Vector3f) -> Colour:
        """Return s(ωi) s(ωo) per channel, less at the horizon."""
        product = mi.UnpolarizedSpectrum(1.0)
        for direction in (site.si.wi, wo):
            cosine = mi.Frame3f.cos_theta(direction)
            product *= mi.UnpolarizedSpectrum(self._scale.at(direction, cosine, site))
            product *= at_horizon(cosine)
        return product

    def reflected(self, direction: Vector3f, site: Site) -> Colour:
        """Return a(ω) over the flat interface's reflectance, per channel; 1 without `beneath`."""
        if not self.beneath:
            return mi.UnpolarizedSpectrum(1.0)
        cosine = mi.Frame3f.cos_theta(direction)
        return mi.UnpolarizedSpectrum(self._ratio.at(direction, cosine, site))

    def _ratio_of(self, energy: Conservation) -> DirectionalTable:
        albedo = energy.albedo
        assert albedo is not None  # of a reflector
        index = self._indices(albedo.wavelengths)
        flat = fresnel.reflectance(np.cos(albedo.grid.theta), index[:, None])
        # of an index of 1 there is neither
        ratio = np.where(flat > 1e-9, 1.0 / np.maximum(flat, 1e-9), 0.0)[:, :, None]
        values = albedo.values * ratio
        if isinstance(index, fresnel.Filmed | Stacked):  # which may reflect next to nothing
            values = np.minimum(values, MOST_RATIO)
        return DirectionalTable(albedo.wavelengths, values.astype(np.float32))


class DielectricEnergy(EnergyModel):
    """Scales c and s of directions on either side of a dielectric.

    Raises a DiffractionError if the table is of one window (`patch`) and not flat: orders interfere
    with order 0 then, which cannot make up for the light of the others.
    """

    def __init__(
        self,
        table: DiffractionTable,
        wavelength: float,
        material: Dielectric,
        model: str,
        thin: bool,
    ) -> None:
        if table.coherence == "patch" and table.roughness.nodes.max() > 0.0:
            raise DiffractionError(
                "coherence='patch' of a rough interface or sheet: its orders interfere with order "
                "0, and R + T cannot be conserved; set energy_conserving to false, or coherence to "
                "'ensemble'"
            )
        super().__init__(table, wavelength)
        self._material, self._model, self._thin = material, model, thin
        self._order_0, self._all_light = ([DirectionLookup(), DirectionLookup()] for _ in range(2))

    def material(self, factors: ScaleRange) -> conserved.Dielectric:
        """See `EnergyModel.material`."""
        index = float(rounded_index(plain(self._material.eta), DIELECTRIC_STEP))
        return conserved.Dielectric(index, self._model, self._thin)

    def lookups(self) -> Iterator[tuple[DirectionLookup, TableOf]]:
        """See `EnergyModel.lookups`."""
        yield self._order_0[0], lambda energy: energy.order_0
        yield self._order_0[1], lambda energy: energy.order_0_below
        yield self._all_light[0], lambda energy: energy.scale
        yield self._all_light[1], lambda energy: energy.scale_below

    @property
    def scales_order_0(self) -> bool:
        """Whether order 0 is scaled by c."""
        return self._order_0[0].present

    @property
    def attenuates(self) -> bool:
        """Whether all light is scaled by s."""
        return self._all_light[0].present

    def order_0_scale(self, site: Site, wo: Vector3f) -> Colour:
        """Return c(ωi) c(ωo) per channel."""
        return self._product(self._order_0, site, wo)

    def attenuation(self, site: Site, wo: Vector3f) -> Colour:
        """Return s(ωi) s(ωo) per channel, less at the horizon."""
        product = mi.UnpolarizedSpectrum(1.0)
        if self.attenuates:
            product = self._product(self._all_light, site, wo)
        for direction in (site.si.wi, wo):
            product *= at_horizon(dr.abs(mi.Frame3f.cos_theta(direction)))
        return product

    def _product(self, lookups: list[DirectionLookup], site: Site, wo: Vector3f) -> Colour:
        """Return the product of a scale at ωi and ωo, each on its side."""
        product = mi.UnpolarizedSpectrum(1.0)
        for direction in (site.si.wi, wo):
            cosine = mi.Frame3f.cos_theta(direction)
            above, below = (
                lookup.at(direction, sign * cosine, site)
                for lookup, sign in zip(lookups, (1.0, -1.0), strict=True)
            )
            sides = zip(above, below, strict=True)
            product *= mi.UnpolarizedSpectrum([dr.select(cosine > 0.0, *both) for both in sides])
        return product


def _rounded_indices(
    material: Material,
    centre: float,
    wavelength_range: tuple[float, float],
    wavelengths: NDArray[np.float64],
) -> Any:
    """Return indices to `INDEX_STEP`, of the light that tables have at these wavelengths.

    centre : factor on lengths, `ScaleRange.centre`; wavelength_range : of the light, nm.
    """
    exact = material.at(np.clip(wavelengths * centre, *wavelength_range))
    if exact is None or isinstance(exact, Stacked):
        return exact
    if isinstance(exact, fresnel.Filmed):
        index, film, depth = exact.parts
        phase = FILM_PHASE / max(float(np.max(np.real(depth))), 1e-9)
        fine = min(INDEX_STEP, 10.0 ** math.floor(math.log10(phase)))  # of decimal numbers as given
        return fresnel.Filmed(rounded_index(index, INDEX_STEP), rounded_index(film, fine), depth)
    return rounded_index(exact, INDEX_STEP)


def rounded_index(index: ArrayLike, step: float) -> NDArray[Any]:
    """An index to a step, finer where it is close to 1, but not to 0, where no wave exists."""
    values = np.asarray(index)
    contrast, fine = np.abs(values - 1.0), 0.02 * step
    rounded = np.where(
        contrast > 4.0 * step, np.round(values / step) * step, np.round(values / fine) * fine
    )
    return np.where(rounded == 0.0, step, rounded)
