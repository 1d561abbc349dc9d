"""Both sides of a dielectric add up to 1: `tables.energy.sides` in a kernel (Dr.Jit)."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ...tables.energy.conservation import DirectionalTable
from ...tables.energy.links import Medium
from ...tables.energy.sides import gathered
from ...tables.energy.store import SidesEnergy
from ...tables.table import DiffractionTable
from ..direction_lookup import DirectionLookup, scales_of
from ..directions import in_patch
from ..fresnel import Dielectric
from ..layers import plain
from ..types import Colour, Float, Mask, Rotation, Vector3f

#: Indices are rounded to this: an optimisation of one waits rarely, and sees s as constant.
INDEX_STEP = 0.01


class SidesModel:
    """Scales of directions on either side, at the height scale and index last given.

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
        own = wavelength, wavelength
        self._range = own if mi.is_monochromatic else table.wavelength_range
        # c above and below, s and g likewise
        self._scales = [DirectionLookup() for _ in range(6)]
        self._index = mi.Float(1.0)
        self._gathered = mi.Float(0.0), mi.Float(0.0)

    def update(self, height_scale: float, differentiable: bool, lowest: float | None) -> None:
        """See `EnergyModel.update`."""
        index = round(plain(self._material.eta) / INDEX_STEP) * INDEX_STEP
        self._index = mi.Float(index)
        dr.make_opaque(self._index)
        medium = Medium(index, self._model, self._thin)
        energy = SidesEnergy(self._table, medium, self._range)
        if lowest is None:
            nodes = list(energy.nodes(height_scale, interval=differentiable))
        else:
            nodes = energy.between(lowest, height_scale)
        found = [energy.at(node) for node in nodes]
        for n, scale in enumerate(self._scales):
            otherwise = 1.0 if n < 4 else 0.0
            tables = scales_of([one[n] if len(one) > n else None for one in found], otherwise)
            scale.update(tables, nodes, height_scale, lowest is not None)
        self._gathered = tuple(mi.Float(one) for one in _gathered(found, medium))
        dr.make_opaque(self._gathered)

    @property
    def takes(self) -> int:
        """How many scales there are: 0, 2, 4 or 6."""
        return sum(scale.present for scale in self._scales)

    @property
    def spreads(self) -> bool:
        """Whether there is a g."""
        return self._scales[4].present

    def products(
        self,
        directions: tuple[Vector3f, Vector3f],
        rotation: Rotation,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> list[Colour]:
        """c(ωi) c(ωo), then s(ωi) s(ωo), then g(ωi) g(ωo), per channel, as far as there are any.

        directions : in the shading frame.
        """
        found = []
        for n in range(self.takes // 2):
            ends = [self._at(n, one, rotation, wavenumbers, height_scale) for one in directions]
            found.append(ends[0] * ends[1])
        return found

    def shares(
        self, direction: Vector3f, rotation: Rotation, wavenumbers: list[Float], height_scale: Float
    ) -> tuple[Float, Float]:
        """What of light along a direction is spread above and below, on the mean of channels."""
        spread = dr.detach(dr.mean(self._at(2, direction, rotation, wavenumbers, height_scale)))
        above, below = self._gathered
        return spread * above, spread * below

    def _at(
        self,
        n: int,
        direction: Vector3f,
        rotation: Rotation,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """The nth pair's value at a direction, per channel."""
        above, below = self._scales[2 * n : 2 * n + 2]
        tangential, cosine = in_patch(direction, rotation), mi.Frame3f.cos_theta(direction)
        given = wavenumbers, height_scale
        both = zip(
            above.at(tangential, cosine, *given),
            below.at(tangential, self._within(-cosine, cosine < 0.0), *given),
            strict=True,
        )
        return mi.UnpolarizedSpectrum([dr.select(cosine > 0.0, *one) for one in both])

    def _within(self, cosine: Float, active: Mask) -> Float:
        """Cosine of `tables.energy.links.Medium.angle`."""
        if self._thin:
            return cosine
        n, cosine = self._index, dr.select(active, cosine, 1.0)
        sine = n * dr.safe_sqrt(dr.fma(-cosine, cosine, 1.0))
        beyond = dr.safe_acos(n * cosine * dr.rsqrt(dr.fma(n, n, -1.0)))
        return dr.cos(0.5 * dr.select(sine < 1.0, dr.safe_asin(sine), 0.5 * dr.pi + beyond))


def _gathered(found: list[list[DirectionalTable]], medium: Medium) -> tuple[float, float]:
    """∫ g n² cosθ dω above and below, on the mean."""
    tables = [one[4:] for one in found if len(one) > 4]
    each = [
        gathered(one, medium, wavelength)
        for one in tables[:1]
        for wavelength in one[0].wavelengths.tolist()
    ]
    above, below = np.mean(each, axis=0) if each else (0.0, 0.0)
    return float(above), float(below)
