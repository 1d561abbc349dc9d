"""Scales of directions by which both sides of a dielectric add up to 1 (Dr.Jit).

The twin of `tables.energy.conservation` of dielectrics in a kernel.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ...errors import DiffractionError
from ...tables.energy.conservation import Energy
from ...tables.energy.conserved import Dielectric as ConservedDielectric
from ...tables.table import DiffractionTable
from ..direction_lookup import DirectionLookup, at_horizon, scales_of
from ..directions import PatchFrame
from ..energy import rounded_index
from ..energy_factors import ScaleRange
from ..fresnel import Dielectric
from ..layers import plain
from ..types import Colour, Float, Vector3f

#: Indices are rounded to this: an optimisation of one waits rarely, and sees c as constant.
INDEX_STEP = 0.01


class DielectricEnergy:
    """Scales c and s of directions on either side, at the height scale and index last given.

    Parameters
    ----------
    table, material, model : of the BSDF.
    thin : whether below is beyond the flat side of a sheet.
    wavelength : nm, for mono variants.

    Raises
    ------
    DiffractionError
        If the table is of one window (`patch`) and not flat: orders interfere with order 0 then,
        which cannot make up for the light of the others.
    """

    def __init__(
        self,
        table: DiffractionTable,
        material: Dielectric,
        model: str,
        thin: bool,
        wavelength: float,
    ) -> None:
        if table.coherence == "patch" and table.roughness.nodes.max() > 0.0:
            raise DiffractionError(
                "coherence='patch' of a rough interface or sheet: its orders interfere with order "
                "0, and R + T cannot be conserved; set energy_conserving to false, or coherence to "
                "'ensemble'"
            )
        self._table, self._material, self._model, self._thin = table, material, model, thin
        mono = wavelength, wavelength
        self._range = mono if mi.is_monochromatic else table.wavelength_range
        self._order_0, self._all_light = ([DirectionLookup(), DirectionLookup()] for _ in range(2))

    def update(self, factors: ScaleRange) -> None:
        """Look up, or compute, c and s at other factors or another index: `EnergyModel.update`."""
        index = float(rounded_index(plain(self._material.eta), INDEX_STEP))
        dielectric = ConservedDielectric(index, self._model, self._thin)
        wavelengths = factors.wavelengths(self._range)
        energy = Energy(self._table, dielectric, wavelengths, factors.least)
        nodes = factors.nodes(energy)
        conserved = [energy.at(node) for node in nodes]
        scales = {
            self._order_0[0]: [each.order_0 for each in conserved],
            self._order_0[1]: [each.order_0_below for each in conserved],
            self._all_light[0]: [each.scale for each in conserved],
            self._all_light[1]: [each.scale_below for each in conserved],
        }
        for lookup, tables in scales.items():
            lookup.update(scales_of(tables), nodes, factors)

    @property
    def scales_order_0(self) -> bool:
        """Whether order 0 is scaled by c."""
        return self._order_0[0].present

    @property
    def attenuates(self) -> bool:
        """Whether all light is scaled by s."""
        return self._all_light[0].present

    def order_0_scale(
        self,
        directions: tuple[Vector3f, Vector3f],
        frame: PatchFrame,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """c(ωi) c(ωo) per channel, of directions in the shading frame."""
        return self._product(self._order_0, directions, frame, wavenumbers, height_scale)

    def attenuation(
        self,
        directions: tuple[Vector3f, Vector3f],
        frame: PatchFrame,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """s(ωi) s(ωo) per channel, of directions in the shading frame; less at the horizon."""
        product = mi.UnpolarizedSpectrum(1.0)
        if self.attenuates:
            product = self._product(self._all_light, directions, frame, wavenumbers, height_scale)
        for direction in directions:
            product *= at_horizon(dr.abs(mi.Frame3f.cos_theta(direction)))
        return product

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
