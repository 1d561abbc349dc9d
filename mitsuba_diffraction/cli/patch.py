"""The one patch of a command that needs heights, not a table, and how it is tabulated."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from .options import load_options, table_options

if TYPE_CHECKING:
    from ..heights.field import HeightField
    from ..settings import TableSettings

#: The settings of a table that the evaluators of the thesis take.
TABLE_NAMES = ("coherence_width", "coherence", "tolerance", "terms")


def load_patch(args: argparse.Namespace) -> tuple[HeightField, dict[str, Any]]:
    """Heights of `args.source`, and the settings of tables: a recipe's, overridden by options.

    Raises
    ------
    DiffractionError
        If the source is a table or no heights, or an option does not fit.
    """
    from ..heights.load import load_heights
    from ..heights.read import is_recipe
    from ..heights.recipes import Recipe
    from ..tables.exr import is_table

    options = load_options(args)
    source = args.source
    if is_table(source):
        raise DiffractionError(
            f"'{source}' is a table; this needs the heights it was made of, or their recipe"
        )
    settings = table_options(args)
    if is_recipe(source):
        recipe = Recipe.load(source)
        settings = {**recipe.table, **settings}
        patch = recipe.field(options)
    else:
        patch = load_heights(source, options)
    return patch, {name: settings[name] for name in TABLE_NAMES if name in settings}


def table_warnings(field: HeightField, settings: TableSettings) -> list[str]:
    """What a table of these heights will be warned of, or be refused for by its size alone."""
    from ..heights.validity import window_warning
    from ..tables.build.checks import check_window

    lines = field.validity(settings.wavelength_range)
    try:
        check_window(field.extent, settings)
    except DiffractionError as error:
        return [*lines, f"{field.name}: {error}"]
    small = window_warning(field, settings.coherence_width)
    return [*lines, *([small] if small else [])]
