"""Tables and BSDFs of scans and recipes, for measurements of them."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..errors import DiffractionWarning
from ..heights.load import load_heights
from ..heights.read import LoadOptions, is_recipe
from ..heights.recipes import Recipe
from ..progress import Progress, silent
from ..scene.load import error_of
from ..settings import TableSettings
from ..tables.build.build import build_with
from ..tables.store import cached_table, key_of
from ..tables.table import DiffractionTable


def table_of(
    path: Path, options: LoadOptions, settings: dict[str, Any], progress: Progress = silent
) -> DiffractionTable:
    """Return the table of a file of heights or a recipe, from the cache or built.

    Parameters
    ----------
    path : heights of any format, or a recipe, whose own settings the others precede.
    options : how heights are read.
    settings : settings of the table by name.
    progress : called as progress(done, total, text).

    Raises
    ------
    DiffractionError
        If the file cannot be read, or no table can be made of it.
    """
    if is_recipe(path):
        recipe = Recipe.load(path)
        fields, settings = recipe.fields(options), {**recipe.table, **settings}
    else:
        fields = [load_heights(path, options)]
    asked = TableSettings(**settings)
    digest = key_of("scan", *(field.digest() for field in fields))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)  # the table keeps its warnings
        return cached_table(digest, asked, lambda: build_with(fields, asked, progress))


def bsdf_of(table: DiffractionTable, **parameters: Any) -> Any:
    """Return the BSDF `diffraction` of a table in the variant that is set.

    parameters : of the plugin, e.g. material="Al".

    Raises a DiffractionError if a parameter has no valid value.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.exr"
        table.save(file)
        try:
            return mi.load_dict({"type": "diffraction", "table": str(file), **parameters})
        except RuntimeError as error:
            raise error_of("cannot make its BSDF", error) from error
