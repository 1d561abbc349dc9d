"""Optical constants over wavelength: conductors of Mitsuba's tables, and tissues."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..columns import read_columns
from ..errors import DiffractionError
from ..optics.materials import METALS, TISSUES
from . import installed
from .parameter_changes import children
from .types import Texture

Array = NDArray[Any]
# Suffixes of files of an index, which solvers read.
_FILES = (".csv", ".txt", ".yml", ".yaml", ".agf")


def _unknown(material: str) -> str:
    """Return the message on an unknown conductor, with the names of known ones."""
    if Path(material.partition(":")[0]).suffix.lower() in _FILES:
        return (
            f"material={material!r}: only 'mitsuba-diffraction solve' reads files of an index; "
            "give its value at one wavelength here, e.g. 1.56 or 3.9+0.02i"
        )
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


def is_tabulated(material: str) -> bool:
    """Return whether a material, conductor or tissue, has a table."""
    return material in TISSUES or material in _tabulated()


def tabulated_index(material: str) -> tuple[Array, Array]:
    """Return wavelengths in nm and n + ik of a conductor or tissue, (n,) each.

    Raises a DiffractionError if no table has that name.
    """
    if tissue := TISSUES.get(material):
        return tissue.nodes, tissue.index(tissue.nodes)
    if material not in _tabulated():
        raise DiffractionError(_unknown(material))
    files = (_folder() / f"{material}.{part}.spd" for part in ("eta", "k"))
    what = "wavelengths in nm and values"
    (nodes, eta), k = (read_columns(file).finite((0, 1), what).T for file in files)
    return nodes, np.asarray(eta + 1j * np.interp(nodes, *k))


#: Wavelengths, nm, between which spectra are constant beyond their nodes.
_ENDS = 100.0, 10000.0


def spectrum_texture(nodes: Array, values: Array, wavelength: float) -> Texture:
    """Return a number over wavelength as a texture, constant beyond its nodes (nm).

    wavelength : nm, where mono variants take it; Mitsuba's is a mean over the spectrum.
    """
    if mi.is_monochromatic or not values.any():  # Mitsuba refuses spectra that are 0 everywhere
        value = float(np.interp(wavelength, nodes, values))
        return mi.load_dict({"type": "uniform", "value": value})
    if mi.is_spectral:
        lists = (", ".join(map(str, part.tolist())) for part in extended(nodes, values))
        return mi.load_dict(
            {"type": "irregular", **dict(zip(("wavelengths", "values"), lists, strict=True))}
        )
    # a conductor's spectra are without bounds in RGB variants
    eta = {"type": "spectrum", "value": list(zip(nodes.tolist(), values.tolist(), strict=True))}
    none = {"type": "uniform", "value": 0.0}
    return children(mi.load_dict({"type": "conductor", "eta": eta, "k": none}))["eta"]


def extended(nodes: Array, values: Array) -> tuple[Array, Array]:
    """Return a spectrum that is constant beyond its nodes (nm), where Mitsuba has 0."""
    ends = np.union1d(nodes, [x for x in _ENDS if not nodes[0] <= x <= nodes[-1]])
    return ends, np.interp(ends, nodes, values)


def _folder() -> Path:
    """Return the folder of Mitsuba's own tables of optical constants."""
    return installed.folder() / "data" / "ior"
