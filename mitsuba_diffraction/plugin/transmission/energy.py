"""Scales of directions by which both sides of a dielectric add up to 1 (Dr.Jit).

The twin of `tables.energy.transmission` in a kernel.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ...tables.energy.store import SidesEnergy
from ...tables.energy.transmission import Medium
from ...tables.table import DiffractionTable
from ..direction_lookup import DirectionLookup, scales_of
from ..directions import PatchFrame
from ..energy_factors import ScaleRange
from ..fresnel import Dielectric
from ..layers import plain
from ..types import Colour, Float, Vector3f

#: Indices are rounded to this: an optimisation of one waits rarely, and sees c as constant.
INDEX_STEP = 0.01


class SidesModel:
    """Scales c and t of directions on either side, at the height scale and index last given.

    Parameters
    ----------
    table, material, model : of the BSDF.
    thin : whether below is beyond the flat side of a sheet.
    wavelength : nm, for mono variants.
    """

    def __init__(
        self,
        table: DiffractionTable,
        material: Dielectric,
        model: str,
        thin: bool,
        wavelength: float,
    ) -> None:
        self._table, self._material, self._model, self._thin = table, material, model, thin
        mono = wavelength, wavelength
        self._range = mono if mi.is_monochromatic else table.wavelength_range
        #: c above and below, t above and below
        self._lookups = [DirectionLookup() for _ in range(4)]

    def update(self, factors: ScaleRange) -> None:
        """Look up, or compute, c and t at other factors or another index: `EnergyModel.update`."""
        index = round(plain(self._material.eta) / INDEX_STEP) * INDEX_STEP
        medium = Medium(index, self._model, self._thin)
        energy = SidesEnergy(self._table, medium, factors.wavelengths(self._range))
        nodes = factors.nodes(energy)
        scales = [energy.at(node) for node in nodes]
        for n, lookup in enumerate(self._lookups):
            tables = scales_of([scale[n] if n < len(scale) else None for scale in scales])
            lookup.update(tables, nodes, factors)

    @property
    def scales_order_0(self) -> bool:
        """Whether order 0 is scaled by c."""
        return self._lookups[0].present

    @property
    def attenuates(self) -> bool:
        """Whether all light is attenuated by t."""
        return self._lookups[2].present

    def order_0_scale(
        self,
        directions: tuple[Vector3f, Vector3f],
        frame: PatchFrame,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """c(ωi) c(ωo) per channel, of directions in the shading frame."""
        return self._product(self._lookups[:2], directions, frame, wavenumbers, height_scale)

    def attenuation(
        self,
        directions: tuple[Vector3f, Vector3f],
        frame: PatchFrame,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """t(ωi) t(ωo) per channel, of directions in the shading frame."""
        return self._product(self._lookups[2:], directions, frame, wavenumbers, height_scale)

    def _product(
        self,
        lookups: list[DirectionLookup],
        directions: tuple[Vector3f, Vector3f],
        frame: PatchFrame,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """Product of a scale at both directions, each on its side."""
        product = mi.UnpolarizedSpectrum(1.0)
        for direction in directions:
            cosine = mi.Frame3f.cos_theta(direction)
            sides = zip(
                lookups[0].at(direction, cosine, frame, wavenumbers, height_scale),
                lookups[1].at(direction, -cosine, frame, wavenumbers, height_scale),
                strict=True,
            )
            product *= mi.UnpolarizedSpectrum([dr.select(cosine > 0.0, *both) for both in sides])
        return product
