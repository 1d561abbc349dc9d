"""Tables and BSDFs of scans and recipes, for measurements of them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

from ..errors import DiffractionWarning
from ..progress import Progress, silent
from ..settings import TableSettings
from ..tables.source import TableSource
from ..tables.table import DiffractionTable


def table_of(
    source: TableSource, settings: TableSettings, progress: Progress = silent
) -> DiffractionTable:
    """Return the table of a source, from the cache or built; it keeps its warnings to itself.

    progress : called as progress(done, total, text).

    Raises a DiffractionError if no table can be made of the source.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return source.table(settings, progress=progress)


def bsdf_of(values: Mapping[str, Any]) -> Any:
    """Return the BSDF of a dictionary of `bsdf_dict` or `preset`, in the current variant.

    Raises a DiffractionError if a parameter has no valid value; `mi.load_dict` would wrap it.
    """
    import mitsuba as mi

    from ..orders.bsdf.diffraction_orders import DiffractionOrders
    from ..plugin.dictionary import ORDERS
    from ..plugin.diffraction import Diffraction

    props = mi.Properties(values["type"])
    for name, value in values.items():
        if name != "type":
            props[name] = value
    return DiffractionOrders(props) if values["type"] == ORDERS else Diffraction(props)
