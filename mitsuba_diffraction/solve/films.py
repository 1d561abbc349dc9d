"""Films on a profile: checked, and named."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import DiffractionError
from ..heights.lengths import number_between
from .materials import Material, material_of
from .stations import Film, Grating

#: Films on a profile, from the material upwards: material and thickness in µm.
Layers = Sequence[tuple[str | float | complex | Material, float]]


def films_of(
    layers: Layers, substance: Material, thin: bool, wavelengths: tuple[float, float]
) -> tuple[Film, ...]:
    """Return the films of layers.

    Raises a DiffractionError if a thickness or material is out of its range, or films lie on a
    perfect conductor or a thin sheet.
    """
    films = tuple(
        Film(
            material_of(material, wavelengths),
            number_between(thickness, f"layer {number}: thickness", 1e-4, 100, " µm"),
        )
        for number, (material, thickness) in enumerate(layers, 1)
    )
    for number, film in enumerate(films, 1):
        if film.material.values is None:
            raise DiffractionError(
                f"layer {number}: a film needs an index; a perfect conductor has none"
            )
    if films and (thin or substance.values is None):
        raise DiffractionError(
            "layers: films lie on a material with an index, and not on thin sheets or perfect "
            "conductors"
        )
    return films


def material_text(grating: Grating) -> str:
    """Return the materials of a grating, for people."""
    films = (f"{film.material.name} {film.thickness:g} µm" for film in reversed(grating.films))
    return " on ".join([*films, grating.material.name])
