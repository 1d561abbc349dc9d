"""Both sides of a dielectric add up to 1: `tables.energy.sides` in a kernel (Dr.Jit)."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ..tables.energy.links import Medium
from ..tables.energy.store import SidesEnergy
from ..tables.table import DiffractionTable
from .direction_lookup import DirectionLookup, scales_of
from .layers import plain
from .pair import in_patch
from .reflectance import Dielectric
from .roles import Colour, Float, Mask, Rotation, Vector3f

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
        # c above and below, s likewise
        self._scales = [DirectionLookup() for _ in range(4)]
        self._index = mi.Float(1.0)

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
            tables = scales_of([one[n] if len(one) > n else None for one in found])
            scale.update(tables, nodes, height_scale, lowest is not None)

    @property
    def takes(self) -> int:
        """How many scales there are: 0, 2 or 4."""
        return sum(scale.present for scale in self._scales)

    def products(
        self,
        directions: tuple[Vector3f, Vector3f],
        rotation: Rotation,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> list[Colour]:
        """c(ωi) c(ωo), then s(ωi) s(ωo), per channel, as far as there are any.

        directions : in the shading frame.
        """
        ends = [(in_patch(one, rotation), mi.Frame3f.cos_theta(one)) for one in directions]

        def product(above: DirectionLookup, below: DirectionLookup) -> Colour:
            result = mi.UnpolarizedSpectrum(1.0)
            for tangential, cosine in ends:
                given = wavenumbers, height_scale
                both = zip(
                    above.at(tangential, cosine, *given),
                    below.at(tangential, self._within(-cosine, cosine < 0.0), *given),
                    strict=True,
                )
                result *= mi.UnpolarizedSpectrum([dr.select(cosine > 0.0, *one) for one in both])
            return result

        pairs = self._scales[:2], self._scales[2:]
        return [product(*pair) for pair in pairs if pair[0].present]

    def _within(self, cosine: Float, active: Mask) -> Float:
        """Cosine of `tables.energy.links.Medium.angle`."""
        if self._thin:
            return cosine
        n, cosine = self._index, dr.select(active, cosine, 1.0)
        sine = n * dr.safe_sqrt(dr.fma(-cosine, cosine, 1.0))
        beyond = dr.safe_acos(n * cosine * dr.rsqrt(dr.fma(n, n, -1.0)))
        return dr.cos(0.5 * dr.select(sine < 1.0, dr.safe_asin(sine), 0.5 * dr.pi + beyond))
