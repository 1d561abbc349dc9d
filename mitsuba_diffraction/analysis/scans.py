"""Tables and BSDFs of scans and recipes, for measurements of them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionWarning
from ..heights import HeightField
from ..plugin.dictionary import ORDERS, bsdf_dict
from ..progress import Progress, silent
from ..settings import TableSettings
from ..tables import DiffractionTable, TableSource, providing
from ..tables.build.build import build_with
from .known_wavelengths import known_range
from .media import medium_index

# Of a flat patch whose table takes no time: µm, and parameters.
_PIXEL, _QUICK = 0.05, {"coherence_width": 1.0, "energy_conserving": False}


def table_of(
    source: TableSource, settings: TableSettings, progress: Progress = silent
) -> DiffractionTable:
    """Return the table of a source, from the cache or built; it keeps its warnings to itself.

    progress : called as progress(done, total, text).

    Raises a DiffractionError if no table can be made of the source.
    """
    with warnings.catch_warnings(action="ignore", category=DiffractionWarning):
        return source.table(settings, progress=progress)


def check_surface(parameters: Mapping[str, Any]) -> None:
    """Refuse parameters of a BSDF that no heights can have, before tables of any are built.

    A flat patch shows whether they fit, in the current variant.

    Raises a DiffractionError if one does not, or the pigment varies over a mesh.
    """
    medium_index(parameters.get("ext_ior"))
    known_range(parameters.get("material"), parameters.get("pigment"))
    flat = HeightField(np.zeros((2, 2)), _PIXEL, periodic=True)
    # the cache holds tables of scans alone
    with providing(lambda request: build_with([flat], request.settings)):
        bsdf_of(bsdf_dict(flat, **{**parameters, **_QUICK}))


def bsdf_of(values: Mapping[str, Any]) -> Any:
    """Return the BSDF of a dictionary of `bsdf_dict` or `preset`, in the current variant.

    Raises a DiffractionError if a parameter has no valid value; `mi.load_dict` would wrap it.
    """
    from ..orders.bsdf.diffraction_orders import DiffractionOrders
    from ..plugin.diffraction import Diffraction

    props = mi.Properties(values["type"])
    for name, value in values.items():
        if name != "type":
            props[name] = value
    return DiffractionOrders(props) if values["type"] == ORDERS else Diffraction(props)
