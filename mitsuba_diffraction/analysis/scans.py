"""Tables and BSDFs of scans and recipes, for measurements of them."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

from ..errors import DiffractionWarning
from ..orders import OrderTable
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


def bsdf_of(table: DiffractionTable | OrderTable, **parameters: Any) -> Any:
    """Return the BSDF of a table, `diffraction` or `diffraction_orders`, in the current variant.

    parameters : of the plugin, e.g. material="Al".

    Raises a DiffractionError if a parameter has no valid value.
    """
    import mitsuba as mi

    from ..orders.bsdf.diffraction_orders import DiffractionOrders
    from ..plugin.diffraction import Diffraction

    with tempfile.TemporaryDirectory() as folder:
        solved = isinstance(table, OrderTable)
        file = Path(folder) / ("table.nc" if solved else "table.exr")
        table.save(file)
        props = mi.Properties("diffraction_orders" if solved else "diffraction")
        for name, value in {"filename": str(file), **parameters}.items():
            props[name] = value
        return DiffractionOrders(props) if solved else Diffraction(props)
