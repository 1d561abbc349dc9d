"""Light for which a surface is known: its material, its pigment, and its table."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from ..errors import DiffractionError
from ..optics.materials import PERFECT, lets_light_through, material_named
from ..plugin.conductors import tabulated_index
from ..plugin.description import Surface
from ..plugin.parameters import refusal
from ..plugin.pigment import pigment_range


def known_range(material: str | None, pigment: str | None = None) -> tuple[float, float]:
    """Return the wavelengths, nm, between which a material and a pigment beneath it are known.

    Raises a DiffractionError if there is no such material, it lets no light through to the pigment,
    or the pigment cannot be read.
    """
    name = PERFECT if material is None else material_named(material)
    first, last = 0.0, math.inf
    if isinstance(name, str) and name != PERFECT:
        nodes, _ = tabulated_index(name)
        first, last = float(nodes[0]), float(nodes[-1])
    least, most = pigment_range(pigment)
    if pigment not in (None, "none") and material is not None and not lets_light_through(material):
        choice = f"material={material}, which lets no light through"
        raise DiffractionError(refusal("the pigment", choice))
    return max(first, least), min(last, most)


def check_material(material: str | None, wavelengths: Real, pigment: str | None = None) -> None:
    """Refuse wavelengths (n,) in nm at which a material, or a pigment beneath it, is unknown."""
    first, last = known_range(material, pigment)
    if not first <= wavelengths.min() <= wavelengths.max() <= last:
        given = {"material": material, "pigment": pigment}
        names = " with ".join(f"{k}='{v}'" for k, v in given.items() if v is not None)
        raise DiffractionError(
            f"{names} is known from {first:.4g} to {last:.4g} nm, and the wavelengths are "
            f"{wavelengths.min():g} to {wavelengths.max():g} nm; give others"
        )


def check_lit(surface: Surface, wavelengths: Real, theta: ArrayLike, phi: ArrayLike) -> None:
    """Refuse wavelengths (n,) in nm of which a surface's table has no light.

    Warns of light, from θ and φ in degrees, outside the directions that solved orders list.
    """
    if surface.solved:
        from ..orders.listed import warn_of_other_directions

        inside = np.sin(np.radians(np.atleast_1d(theta))) / surface.orders.superstrate
        turned = np.atleast_1d(phi) - surface.orientation.number
        warn_of_other_directions(surface.orders, np.degrees(np.arcsin(inside)), turned)
    low, high = surface.lit
    unlit = wavelengths[(wavelengths < low) | (wavelengths > high)]
    if not unlit.size:
        return
    first, last = surface.orders.wavelengths if surface.solved else surface.wavelengths
    raise DiffractionError(
        f"wavelength {unlit[0]:g} nm: the table has {first:g} to {last:g} nm, and no light of this "
        "one; give others, or make a table of a wider range of wavelengths"
    )
