"""Surfaces with a table of heights for shaders: constants, energy conservation, tables, lobes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...optics.boundary import MODELS
from ...optics.colour import RGB_WAVELENGTHS, response
from ...optics.geometry import wavenumber
from ...plugin.description import Feature, Surface
from ...progress import show, tracked
from ...tables.colour.table import cached_colours
from ...tables.directional import DirectionalTable
from .lanes import evaluated
from .lobes import colour_power, pack_lobes
from .packing import (
    pack_boundary,
    pack_colours,
    pack_conductor,
    pack_directions,
    pack_powers,
)
from .texels import Packed, Uniform

#: Wavelengths at which a conductor's index is packed, nm; RGB variants have three of them.
_INDEX_WAVELENGTHS = np.union1d(np.linspace(360.0, 830.0, 96), RGB_WAVELENGTHS)


class Modelled:
    """Table of heights of a surface as textures and constants."""

    def __init__(self, described: Surface) -> None:
        self.described = described
        self._coat = 1.0 if described.coat is None else described.coat

    @property
    def words(self) -> str:
        """Description in a few words."""
        described = self.described
        return (
            f"{described.text}, coherence width {described.patch.width_text}, "
            f"height scale {described.height_scale.number:g}"
        )

    @property
    def height_room(self) -> float:
        """Largest factor on the height scale that the table serves."""
        scale = self._coat * self.described.height_scale.number
        return self.described.patch.height_scale_max / max(scale, 1e-9)

    def surface(self) -> Packed:
        """Pack constants and definitions that all methods share."""
        described = self.described
        definitions = {"DIFFRACTING": ""}
        uniforms: dict[str, Uniform] = {"height_scale": described.height_scale.number}
        if described.shadowing:
            definitions["VCAVITY"] = ""
        if described.coat is not None:
            definitions["COATED"] = ""
            uniforms["coat"] = self._coat
            uniforms["channel_wavenumbers"] = tuple(wavenumber(RGB_WAVELENGTHS).tolist())
        packed = Packed((), uniforms, definitions)
        if described.model != "kirchhoff" or described.coat is not None:
            packed |= pack_boundary(MODELS[described.model], described.patch.roughness)
        return packed | _reflectance(described)

    def conservation(self, scales: Sequence[float]) -> Packed:
        """Pack energy conservation and the base's light, one page per height scale."""
        excesses, pages = [], []
        for scale in tracked(scales, show, "scales of energy"):
            excesses.append(self.described.albedo_excess(scale))
            page = self.described.energy_scale(scale)
            pages.append(None if page is None else luminous_mean(page))
        return pack_directions(excesses, pages)

    def tables(self, method: str) -> Packed:
        """Pack the table for `fast` or `exact`."""
        if method == "fast":
            return pack_colours(cached_colours(self.described.patch))
        return pack_powers(self.described.patch)

    def lobes(self) -> Packed:
        """Pack directions drawn from the lobes, for shaders/lobes.glsl."""
        colours = cached_colours(self.described.patch)
        factor = self.described.height_scale.number * self._coat
        return pack_lobes(lambda edges: colour_power(colours, edges, factor), colours.sigma_0)


def luminous_mean(table: DirectionalTable) -> NDArray[np.float32]:
    """Average scales s over wavelengths as bright as they are, (polar + 1, azimuthal).

    The mean is that of 1/s², as in the plugin's RGB variants.
    """
    weights = response(table.wavelengths)[:, 1] * table.wavelengths
    return np.average(table.values**-2.0, axis=0, weights=weights).astype(np.float32) ** -0.5


def _reflectance(described: Surface) -> Packed:
    """Pack the Fresnel reflectance of a dielectric or conductor."""
    if described.index is None:
        return Packed()
    index = described.index(_INDEX_WAVELENGTHS)
    if described.kind is Feature.DIELECTRIC:
        return Packed(uniforms={"eta": float(index[0].real)}, definitions={"SURFACE_KIND": "1"})
    # total reflection has phases like a conductor
    return pack_conductor(_INDEX_WAVELENGTHS, index.real, index.imag)


def index_spectra(eta: Any, k: Any) -> tuple[Real, Real, Real]:
    """Evaluate the textures of an index η + ik; RGB values become three wavelengths.

    Returns wavelengths in nm, η and k, (n,) each.
    """
    import mitsuba as mi

    # in RGB variants the wavelengths of sRGB's primaries, which textures list from red to blue
    lam = np.linspace(360.0, 830.0, 96) if mi.is_spectral else np.array([464.0, 549.0, 611.0])
    order = slice(None, None, 1 if mi.is_spectral else -1)
    uv = np.full((1, 2), 0.5)
    of_eta, of_k = (evaluated(t, uv, lam)[0][order].astype(float) for t in (eta, k))
    return lam, of_eta, of_k
