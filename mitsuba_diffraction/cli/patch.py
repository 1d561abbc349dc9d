"""The one patch of a command that needs heights, not a table, and how it is tabulated."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from ..reference import COHERENCES
from .arguments import whole_number
from .heights_options import load_options

if TYPE_CHECKING:
    from ..heights.field import HeightField

_TABLE_NAMES = ("coherence_width", "coherence", "tolerance", "terms")


def add_table_options(group: argparse._ArgumentGroup, *, coherence: str) -> None:
    """Declare the settings that `load_patch` returns; `coherence` tells that one's default."""
    group.add_argument(
        "--coherence-width", metavar="W", type=float, help="µm, 4σ of the window; default: 65"
    )
    group.add_argument("--coherence", choices=COHERENCES, help=f"default: {coherence}")
    group.add_argument("--tolerance", metavar="E", type=float, help="of the tables; default: 1e-3")
    group.add_argument("--terms", metavar="N", type=whole_number(1), help="of Taylor series")


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
