"""The one patch of a command that needs heights, not a table."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from .heights_options import load_options

if TYPE_CHECKING:
    from ..heightfield import HeightField

_TABLE_NAMES = ("coherence_width", "coherence", "tolerance", "terms")


def load_patch(args: argparse.Namespace) -> tuple[HeightField, dict[str, Any]]:
    """Heights of `args.source`, and the settings of tables: a recipe's, overridden by options.

    Raises
    ------
    DiffractionError
        If the source is a table or no heights, or an option does not fit.
    """
    from ..files.heights import is_recipe, load_heights
    from ..files.recipes import Recipe
    from ..files.table_exr import read_document

    options = load_options(args)
    source = args.source
    if source.suffix.lower() == ".exr" and source.is_file() and read_document(source) is not None:
        raise DiffractionError(
            f"'{source}' is a table; this needs the heights it was made of, or their recipe"
        )
    settings: dict[str, Any] = {}
    if is_recipe(source):
        recipe = Recipe.load(source)
        settings = {k: v for k, v in recipe.table_arguments().items() if k in _TABLE_NAMES}
        patch = recipe.field(options)
    else:
        patch = load_heights(source, options)
    for name in _TABLE_NAMES:
        if getattr(args, name, None) is not None:
            settings[name] = getattr(args, name)
    return patch, settings
