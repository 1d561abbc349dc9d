"""Optical constants over wavelength: conductors of Mitsuba's tables, and tissues."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..optics.colour import LONGEST, SHORTEST
from ..optics.materials import METALS, TISSUES
from . import installed
from .types import Texture

Array = NDArray[Any]


def unknown_conductor(material: str) -> str:
    """Return the message on an unknown conductor, with the names of known ones."""
    names = [*TISSUES, *_names()]
    words = [name.lower() for name in (*names, *METALS)]
    close = difflib.get_close_matches(material.lower(), words, 3, 0.6)
    listed = [name for name in (*names, *METALS) if name.lower() in close] or names
    hint = f"; did you mean {' or '.join(listed)}?" if close else f"; there are {', '.join(names)}"
    return (
        f"material={material!r} is unknown{hint} Or give an index, e.g. 1.56 or 1.56+0.05i, or "
        "none for R = 1"
    )


def _names() -> list[str]:
    """Return names of tabulated conductors, without second entries from Palik's table."""
    names = _tabulated()
    return sorted(
        (name for name in names if name.removesuffix("_palik") not in names - {name}),
        key=str.lower,
    )


def _tabulated() -> set[str]:
    return {file.name.removesuffix(".eta.spd") for file in _folder().glob("*.eta.spd")}


def tabulated_range(material: str) -> tuple[float, float] | None:
    """Return the first and the last wavelength, nm, of a material's table, if there is one."""
    if material not in TISSUES and material not in _tabulated():
        return None
    nodes, _ = _table(material, "eta")
    return float(nodes[0]), float(nodes[-1])


def tabulated_index(material: str) -> tuple[Array, Array]:
    """Return wavelengths in nm and n + ik of a conductor or tissue, (n,) each.

    Raises a DiffractionError if no table has that name.
    """
    if tabulated_range(material) is None:
        raise DiffractionError(unknown_conductor(material))
    nodes, eta = _table(material, "eta")
    k = tabulated(material, "k", nodes)
    return nodes, np.asarray(eta + 1j * k)


def parameters_of(material: str) -> dict[str, Any]:
    """Return a material as parameters of Mitsuba's BSDF `conductor`."""
    tissue = TISSUES.get(material)
    if tissue is None:
        return {"material": material}
    parts = {"eta": tissue.index(tissue.nodes).real, "k": tissue.index(tissue.nodes).imag}
    pairs = {
        name: list(zip(tissue.nodes.tolist(), part.tolist(), strict=True))
        for name, part in parts.items()
    }
    spectra = {name: {"type": "spectrum", "value": values} for name, values in pairs.items()}
    # Mitsuba refuses spectra that are 0 everywhere
    return spectra if tissue.absorbs else spectra | {"k": {"type": "uniform", "value": 0.0}}


def texture_at(material: str, name: str, wavelength: float) -> Texture:
    """Part of a material's index at one wavelength, as a texture."""
    value = float(tabulated(material, name, wavelength))
    return mi.load_dict({"type": "uniform", "value": value})


def extended_texture(material: str, name: str) -> Texture:
    """Part of a material's index as a texture, constant beyond the ends of the table.

    Mitsuba's own has the index 0 there.
    """
    nodes, _ = _table(material, name)
    nodes = np.union1d(nodes, [SHORTEST, LONGEST])
    wavelengths, values = (
        ", ".join(map(str, numbers.tolist()))
        for numbers in (nodes, tabulated(material, name, nodes))
    )
    return mi.load_dict({"type": "irregular", "wavelengths": wavelengths, "values": values})


def tabulated(material: str, name: str, wavelengths: Array | float) -> Array:
    """Part of a material's index at wavelengths in nm, as it is tabulated."""
    return np.asarray(np.interp(wavelengths, *_table(material, name)))


def _table(material: str, name: str) -> Array:
    """Wavelengths in nm and values of a part of a material's index, (2, n)."""
    if tissue := TISSUES.get(material):
        index = tissue.index(tissue.nodes)
        return np.stack([tissue.nodes, index.real if name == "eta" else index.imag])
    return np.asarray(np.loadtxt(_folder() / f"{material}.{name}.spd").T)


def _folder() -> Path:
    """Return the folder of Mitsuba's own tables of optical constants."""
    return installed.folder() / "data" / "ior"
