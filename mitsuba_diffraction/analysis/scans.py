"""Heights, tables and BSDFs of scans and recipes, for measurements of them.

All measurements of a scan share its table in the cache.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import DiffractionWarning
from ..files import FileKind, kind_of
from ..heights.field import HeightField
from ..heights.load import load_heights
from ..heights.read import LoadOptions
from ..heights.recipes import Recipe
from ..progress import Progress, silent
from ..settings import TableSettings
from ..tables.build.build import build_with
from ..tables.orders import CrossedTable, OrderTable
from ..tables.store import cached_table, key_of
from ..tables.table import DiffractionTable


class Scan(NamedTuple):
    """Heights of a scan, or the patches of a recipe, and the settings of their table."""

    patches: list[HeightField]
    settings: TableSettings


def read_scan(path: Path, options: LoadOptions, settings: Mapping[str, Any]) -> Scan:
    """Read a file of heights or a recipe.

    Raises a DiffractionError if the file cannot be read, or a setting is not allowed.

    Parameters
    ----------
    path : heights of any format, or a recipe.
    options : how heights are read.
    settings : settings of the table by name, which precede the recipe's.
    """
    if kind_of(path) is not FileKind.RECIPE:
        return Scan([load_heights(path, options)], TableSettings(**settings))
    recipe = Recipe.load(path)
    return Scan(recipe.fields(options), TableSettings(**{**recipe.table, **settings}))


def table_of(scan: Scan, progress: Progress = silent) -> DiffractionTable:
    """Return the table of a scan, from the cache or built; it keeps its warnings to itself.

    progress : called as progress(done, total, text).

    Raises a DiffractionError if no table can be made of the scan.
    """
    patches, settings = scan
    names = [patch.name for patch in patches]
    digest = key_of("scan", *(patch.digest() for patch in patches))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return cached_table(
            digest, settings, lambda: build_with(patches, settings, progress), names
        )


def bsdf_of(table: DiffractionTable | OrderTable | CrossedTable, **parameters: Any) -> Any:
    """Return the BSDF of a table, `diffraction` or `diffraction_orders`, in the current variant.

    parameters : of the plugin, e.g. material="Al".

    Raises a DiffractionError if a parameter has no valid value.
    """
    import mitsuba as mi

    from ..plugin.diffraction import Diffraction
    from ..plugin.orders.orders_block import diffraction_orders

    with tempfile.TemporaryDirectory() as folder:
        solved = isinstance(table, OrderTable | CrossedTable)
        file = Path(folder) / ("table.nc" if solved else "table.exr")
        table.save(file)
        props = mi.Properties("diffraction_orders" if solved else "diffraction")
        for name, value in {"table": str(file), **parameters}.items():
            props[name] = value
        return diffraction_orders(props) if solved else Diffraction(props)
