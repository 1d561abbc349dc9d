"""Surfaces of the BSDF `diffraction` for shaders: constants, energy conservation, tables, lobes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...optics.colour import RGB_WAVELENGTHS
from ...optics.geometry import wavenumber
from ...tables.directional import FINE
from ...tables.store import cached_colours
from ...tables.table import DiffractionTable
from .lobes import colour_power, pack_lobes
from .maps import Map, axis_map, evaluated
from .packing import (
    pack_beneath,
    pack_colours,
    pack_conductor,
    pack_energy,
    pack_powers,
    pack_roughness,
    pack_second_order,
)
from .texels import Packed, Uniform

Array = NDArray[np.float64]


class Modelled:
    """Surface of a `diffraction` BSDF; see `materials.Diffracting`."""

    def __init__(self, bsdf: Any) -> None:
        self.bsdf = bsdf
        self.table: DiffractionTable = bsdf.table
        self.nested = bsdf.nested
        self.height_scale = number_of(bsdf.height_scale)
        self.largest_scale: float | None = float(self.table.height_scale_max)
        self.coherence_width = float(self.table.coherence_width)
        self.coherent = self.table.grid.coherent

    @property
    def axis(self) -> Map:
        """See `Diffracting.axis`."""
        return axis_map(self.bsdf.orientation, self.bsdf.lateral_scale)

    @property
    def heights(self) -> HeightField:
        """See `Diffracting.heights`."""
        heights: HeightField = self.bsdf.heights()
        return heights

    @property
    def stretch(self) -> float:
        """See `Diffracting.stretch`."""
        if self.bsdf.lateral_scale.varying is not None:
            raise DiffractionError(
                "the surface has a lateral_scale that varies, which this export does not support: "
                "export one with a number for each period"
            )
        return float(self.axis.value[2])

    @property
    def words(self) -> str:
        """See `Diffracting.words`."""
        return (
            f"{self.bsdf.fresnel}, coherence width {self.table.width_text}, "
            f"height scale {self.height_scale:g}"
        )

    @property
    def _coat(self) -> float:
        """Index of the coat over that of the medium above; 1 without a coat."""
        return 1.0 if self.bsdf.coat is None else number_of(self.bsdf.coat.eta)

    def surface(self) -> Packed:
        """See `Diffracting.surface`."""
        bsdf = self.bsdf
        definitions, uniforms = {"DIFFRACTING": ""}, dict[str, Uniform]()
        if bsdf.vcavity:
            definitions["VCAVITY"] = ""
        if hasattr(bsdf.layering, "weight"):
            definitions["THESIS"] = ""
            uniforms["diffuse_weight"] = float(bsdf.layering.weight)
        face = bsdf.fresnel
        if bsdf.coat is not None:
            face = face.material
            definitions["COATED"] = ""
            uniforms["coat"] = self._coat
            uniforms["channel_wavenumbers"] = tuple(wavenumber(RGB_WAVELENGTHS).tolist())
        packed = Packed((), uniforms, definitions)
        if bsdf.boundary.model.statistic is not None:
            packed |= pack_roughness(self.table.roughness)
        ratios = self.table.slope_ratios
        if bsdf.second_order_index is not None and ratios is not None:
            packed |= pack_second_order(bsdf.second_order_index, ratios)
        return packed | _reflectance(face)

    def conservation(self, scales: Sequence[float]) -> Packed:
        """See `Diffracting.conservation`."""
        ratios = [self.bsdf.reflected_ratio(scale) for scale in scales]
        beneath = pack_beneath([ratio for ratio in ratios if ratio is not None])
        energy = [self.bsdf.energy_scale(scale) for scale in scales]
        if all(scale is None for scale in energy):
            return beneath
        ones = FINE.ones
        return beneath | pack_energy([ones if scale is None else scale for scale in energy])

    def tables(self, method: str, *, floats: bool = False) -> Packed:
        """See `Diffracting.tables`."""
        if method == "fast":
            return pack_colours(cached_colours(self.table), floats=floats)
        return pack_powers(self.table)

    def lobes(self) -> Packed:
        """See `Diffracting.lobes`."""
        colours, factor = cached_colours(self.table), self.height_scale * self._coat
        return pack_lobes(lambda edges: colour_power(colours, edges, factor), colours.sigma)


def number_of(value: Any) -> float:
    """Convert a Dr.Jit value of one element to a float."""
    return float(np.array(value).ravel()[0])


def _reflectance(surface: Any) -> Packed:
    """Pack the Fresnel reflectance of a dielectric or conductor."""
    kind = type(surface).__name__
    if kind == "Dielectric":
        ratio = number_of(surface.eta)
        if ratio < 1.0:  # total reflection has phases like a conductor
            return pack_conductor(np.array([360.0, 830.0]), np.full(2, ratio), np.zeros(2))
        return Packed(uniforms={"eta": ratio}, definitions={"SURFACE_KIND": "1"})
    if kind == "Conductor":
        lam, eta, k = index_spectra(surface.eta, surface.k)
        medium = 1.0 if surface.medium is None else number_of(surface.medium.eta)
        return pack_conductor(lam, eta / medium, k / medium)
    return Packed()


class IndexSpectra(NamedTuple):
    """Complex index of refraction η + ik over wavelengths, (n,) each."""

    wavelengths: Array  # nm
    eta: Array
    k: Array


def index_spectra(eta: Any, k: Any) -> IndexSpectra:
    """Evaluate the textures of an index; RGB values become three wavelengths."""
    import mitsuba as mi

    # in RGB variants the wavelengths of sRGB's primaries, which textures list from red to blue
    lam = np.linspace(360.0, 830.0, 96) if mi.is_spectral else np.array([464.0, 549.0, 611.0])
    order = slice(None, None, 1 if mi.is_spectral else -1)
    uv = np.full((1, 2), 0.5)
    return IndexSpectra(lam, *(evaluated(t, uv, lam)[0][order].astype(float) for t in (eta, k)))
