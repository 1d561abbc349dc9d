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
from ..directions import in_patch
from ..fresnel import Dielectric
from ..layers import plain
from ..types import Colour, Float, Rotation, Vector3f

#: Indices are rounded to this: an optimisation of one waits rarely, and sees c as constant.
INDEX_STEP = 0.01


class SidesModel:
    """Scale c of directions on either side, at the height scale and index last given.

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
        self._above, self._below = DirectionLookup(), DirectionLookup()

    def update(self, height_scale: float, differentiable: bool, lowest: float | None) -> None:
        """Look up, or compute, c at another height scale or index; see `EnergyModel.update`."""
        index = round(plain(self._material.eta) / INDEX_STEP) * INDEX_STEP
        medium = Medium(index, self._model, self._thin)
        energy = SidesEnergy(self._table, medium, self._range)
        if lowest is None:
            nodes = list(energy.nodes(height_scale, interval=differentiable))
        else:
            nodes = energy.between(lowest, height_scale)
        scales = [energy.at(node) for node in nodes]
        for side, lookup in enumerate((self._above, self._below)):
            tables = scales_of([scale[side] if scale else None for scale in scales])
            lookup.update(tables, nodes, height_scale, lowest is not None)

    @property
    def active_factors(self) -> bool:
        """Whether order 0 is scaled at all."""
        return self._above.present

    def product(
        self,
        directions: tuple[Vector3f, Vector3f],
        rotation: Rotation,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """c(ωi) c(ωo) per channel, of directions in the shading frame."""
        ends = [self._at(one, rotation, wavenumbers, height_scale) for one in directions]
        return ends[0] * ends[1]

    def _at(
        self, direction: Vector3f, rotation: Rotation, wavenumbers: list[Float], height_scale: Float
    ) -> Colour:
        """c at a direction, per channel."""
        tangential, cosine = in_patch(direction, rotation), mi.Frame3f.cos_theta(direction)
        sides = zip(
            self._above.at(tangential, cosine, wavenumbers, height_scale),
            self._below.at(tangential, -cosine, wavenumbers, height_scale),
            strict=True,
        )
        return mi.UnpolarizedSpectrum([dr.select(cosine > 0.0, *both) for both in sides])
