"""Surfaces that diffract, for shaders: constants, energy conservation, tables, lobes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...optics.boundary import MODELS
from ...optics.colour import RGB_WAVELENGTHS, response
from ...optics.geometry import wavenumber
from ...plugin.description import Feature, Surface
from ...progress import show, tracked
from ...shading.spectra import evaluated
from ...tables.colour.table import cached_colours
from ...tables.directional import DirectionalTable
from .lobes import colour_power, pack_lobes
from .methods import METHODS, refusal
from .packing import (
    pack_boundary,
    pack_colours,
    pack_conductor,
    pack_directions,
    pack_powers,
)
from .solved import order_power, pack_orders
from .texels import Packed, Uniform

#: Wavelengths at which a conductor's index is packed, nm; RGB variants have three of them.
_INDEX_WAVELENGTHS = np.union1d(np.linspace(360.0, 830.0, 96), RGB_WAVELENGTHS)


def words_of(described: Surface) -> str:
    """Return a description of the table in a few words."""
    if described.solved:
        return f"{described.orders}, coherence width {described.coherence_width:g} µm"
    return (
        f"{described.text}, coherence width {described.patch.width_text}, "
        f"height scale {described.height_scale.number:g}"
    )


def height_room(described: Surface) -> float:
    """Return the largest factor on the height scale that the table serves."""
    if described.solved:
        return np.inf  # nothing depends on a height scale
    return described.patch.height_scale_max / max(_depth(described), 1e-9)


def _depth(described: Surface) -> float:
    """Return the factor on the heights, the index of a coat included."""
    return described.height_scale.number * (described.coat or 1.0)


def pack_constants(described: Surface) -> Packed:
    """Pack constants and definitions that all methods share."""
    channels = tuple(wavenumber(RGB_WAVELENGTHS).tolist())
    if described.solved:
        return Packed((), {"channel_wavenumbers": channels}, {"DIFFRACTING": ""})
    definitions = {"DIFFRACTING": ""}
    uniforms: dict[str, Uniform] = {"height_scale": described.height_scale.number}
    if described.shadowing:
        definitions["VCAVITY"] = ""
    if described.coat is not None:
        definitions["COATED"] = ""
        uniforms |= {"coat": described.coat, "channel_wavenumbers": channels}
    packed = Packed((), uniforms, definitions)
    if described.model != "kirchhoff" or described.coat is not None:
        packed |= pack_boundary(MODELS[described.model], described.patch.roughness)
    return packed | _reflectance(described)


def pack_conservation(described: Surface, factors: Sequence[float] = (1.0,)) -> Packed:
    """Pack energy conservation and the base's light, a page for the height scale times each factor.

    Solved orders conserve energy: they have none.
    """
    if described.solved:
        return Packed()
    excesses, pages = [], []
    for factor in tracked(factors, show, "scales of energy"):
        scale = described.height_scale.number * factor
        excesses.append(described.albedo_excess(scale))
        page = described.energy_scale(scale)
        pages.append(None if page is None else luminous_mean(page))
    return pack_directions(excesses, pages)


def pack_table(described: Surface, method: str) -> Packed:
    """Pack the table for a method.

    Raises a DiffractionError if the method is unknown, or does not support the table.
    """
    if reason := refusal(method, described):
        raise DiffractionError(reason)
    if described.solved:
        return pack_orders(method, described.orders, described.sigma)
    if (pack := METHODS[method].tables) is not None:
        return pack(described)
    if method == "fast":
        return pack_colours(cached_colours(described.patch))
    return pack_powers(described.patch)


def lobes_of(described: Surface) -> Packed:
    """Pack directions drawn from the lobes, for shaders/lobes.glsl."""
    if described.solved:
        table, sigma = described.orders, described.sigma
        return pack_lobes(lambda edges: order_power(table, sigma, edges), sigma)
    colours = cached_colours(described.patch)
    return pack_lobes(
        lambda edges: colour_power(colours, edges, _depth(described)), colours.sigma_0
    )


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
