"""Tables of the sources that a scene names: images, recipes, tables, arrays; each built once."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, warn
from ..files import FileKind, kind_of, readable_file
from ..heights import gratings
from ..heights.field import HeightField
from ..heights.load import load_heights, notes_line
from ..heights.read import LoadOptions, treat
from ..heights.recipes import Recipe
from ..settings import MAX_HEIGHT_SCALE, TableSettings
from ..tables.build.build import build_with
from ..tables.build.checks import warnings_of
from ..tables.store import cached_table, key_of, loaded_table
from ..tables.table import DiffractionTable
from .dictionary import HeightData

#: A table serves heights scaled by up to this times max(1, height_scale).
HEIGHT_SCALE_ROOM = 1.5
#: Mitsuba samples its spectral variants' wavelengths from here on, nm.
SHORTEST_WAVELENGTH = 360.0


@dataclass(frozen=True)
class TableRequest:
    """The table of heights that a BSDF asks for.

    Attributes
    ----------
    digest : of the heights.
    settings : of the table.
    height_scale : the largest factor on the heights that the BSDF uses.
    names : of the patches.
    build : builds the table with any settings.
    recipe : says where the heights come from; None for an array.
    """

    digest: str
    settings: TableSettings
    height_scale: float
    names: tuple[str, ...]
    build: Callable[[TableSettings], DiffractionTable]
    recipe: Recipe | None

    def cached(self, settings: TableSettings) -> DiffractionTable:
        """The table with these settings, from the cache or built."""
        return cached_table(self.digest, settings, lambda: self.build(settings), self.names)


class Factors(NamedTuple):
    """Factors on the heights that a table is to serve.

    height_scale : the largest factor on the heights.
    stretch : factor on lengths in the patch's plane, at least 1.
    """

    height_scale: float
    stretch: float


#: Gets the table that is asked for.
TableProvider = Callable[[TableRequest], DiffractionTable]


def from_cache(request: TableRequest) -> DiffractionTable:
    """The `TableProvider` of all scenes that are not being planned."""
    return request.cached(request.settings)


def table_of_file(
    path: Path,
    must_be_table: bool,
    options: LoadOptions,
    asked: Mapping[str, Any],
    factors: Factors,
    provider: TableProvider,
) -> DiffractionTable:
    """Return the table of a file: a table, a recipe, or a height field of any format.

    Parameters
    ----------
    path : the file.
    must_be_table : refuse anything but a table.
    options : how to read heights.
    asked : the fields of `TableSettings` that the scene sets, checked.
    factors : the factors that are asked for.
    provider : gets the tables of heights.
    """
    kind = kind_of(path)
    if kind is FileKind.ORDERS:
        raise DiffractionError(
            f"'{path}' is a table of orders, which the BSDF 'diffraction_orders' has as its table; "
            "change the type of the BSDF, or give heights"
        )
    if must_be_table or kind is FileKind.TABLE:
        table = loaded_table(path)
        _check_agreement(path, table, options, asked)
        height_scale = factors.height_scale
        if factors.stretch > 1.0:
            raise DiffractionError(
                f"lateral_scale={factors.stretch:g} is above 1, beyond the frequencies of the "
                f"table '{path}'; give the height field instead of the table"
            )
        if height_scale > table.height_scale_max:
            raise DiffractionError(
                f"height_scale={height_scale:g} is beyond the table's "
                f"{table.height_scale_max:g} (a coat counts as its index times the heights); give "
                "the height field instead of the table, or build it with "
                f"DiffractionTable.build(height_scale_max={height_scale:.4g}) or more"
            )
    elif kind is FileKind.RECIPE:
        recipe = Recipe.load(path)
        table = provider(
            _request(
                _recipe_digest(recipe, options),
                lambda: recipe.fields(options),
                {**recipe.table, **asked},
                factors,
                replace(recipe, options=recipe.options.updated(options)),
            )
        )
    else:
        table = provider(
            _request(
                _file_digest(path, options),
                lambda: [load_heights(path, options)],
                asked,
                factors,
                Recipe.of_file(path, options),
            )
        )
    if table.limited:
        x, y = table.frequency_limit
        warn(
            f"{path.name}: the table ends at the frequencies {x:.4g} along x and {y:.4g} rad/µm "
            "along y (frequency_limit): light that the surface sends beyond is missing"
        )
    return table


def heights_of_file(path: Path, must_be_table: bool, options: LoadOptions) -> HeightField:
    """Return the heights that a scene names; the first of a recipe's several.

    Raises a DiffractionError if it names a table, which does not hold them.
    """
    kind = kind_of(path)
    if must_be_table or kind is FileKind.TABLE:
        raise DiffractionError(
            f"'{path}' is a table and does not hold the heights that it was made of; give the "
            "scene the height field instead"
        )
    if kind is FileKind.RECIPE:
        return Recipe.load(path).fields(options)[0]
    return load_heights(path, options)


def heights_of_tensor(data: Any, options: LoadOptions) -> HeightField:
    """Return heights (ny, nx) in µm from an array, or from `bsdf_dict`'s HeightField.

    Raises a DiffractionError if pixel_size is missing, max_height is given, or the array holds no
    heights.
    """
    for name in ("max_height", "height_unit"):
        if getattr(options, name) is not None:
            raise DiffractionError(f"{name} is for files; the heights in data are in µm already")
    if isinstance(data, HeightData):
        if options.pixel_size not in (None, data.field.pixel_size):
            raise DiffractionError("pixel_size is for arrays; a HeightField has its own already")
        return treat(data.field, options)
    if options.pixel_size is None:
        raise DiffractionError("data needs pixel_size, the distance between its heights in µm")
    values = np.array(data, np.float64)
    if values.ndim == 3 and values.shape[2] == 1:
        values = values[..., 0]
    return treat(HeightField(values, options.pixel_size, name="data"), options)


def table_of_heights(
    heights: HeightField, asked: Mapping[str, Any], height_scale: float, provider: TableProvider
) -> DiffractionTable:
    """Return the table of a height field."""
    factors = Factors(height_scale, 1.0)
    names = (heights.name,)
    return provider(_request(heights.digest(), lambda: [heights], asked, factors, None, names))


def _request(
    digest: str,
    load: Callable[[], list[HeightField]],
    asked: Mapping[str, Any],
    factors: Factors,
    recipe: Recipe | None,
    names: tuple[str, ...] = (),
) -> TableRequest:
    height_scale, stretch = factors

    def build(settings: TableSettings) -> DiffractionTable:
        heights = [field.stretched(stretch) for field in load()]
        mi.Log(mi.LogLevel.Info, f"diffraction: building the table of {heights[0].name}")
        table = build_with(heights, settings)
        lines = warnings_of(heights, settings)
        if lines and recipe is not None:
            lines = [notes_line(lines, recipe.path, recipe.options, settings)]
        for line in lines:
            warn(line)
        return table

    if stretch != 1.0:
        digest = key_of(digest, stretch)
    room = min(HEIGHT_SCALE_ROOM * max(1.0, height_scale), MAX_HEIGHT_SCALE)
    settings = TableSettings(**{"height_scale_max": room, **asked})
    if height_scale > settings.height_scale_max:
        raise DiffractionError(
            f"height_scale={height_scale:g} is beyond height_scale_max="
            f"{settings.height_scale_max:g} of the recipe (a coat counts as its index times the "
            "heights); raise it there"
        )
    if recipe is not None:
        names = tuple(source.name for source in recipe.sources) or (str(recipe.generator),) * len(
            recipe.arguments
        )
    return TableRequest(digest, settings, height_scale, names, build, recipe)


def _file_digest(path: Path, options: LoadOptions) -> str:
    return key_of(options.specified(), _sha256(path))


def _recipe_digest(recipe: Recipe, options: LoadOptions) -> str:
    """Return a digest of the recipe's text, its sources and the generators."""
    files = [readable_file(source) for source in recipe.sources]
    if recipe.generator is not None:
        files += sorted(Path(gratings.__file__).parent.glob("*.py"))
    arguments = [dict(patch) for patch in recipe.arguments]
    options_of_both = [recipe.options.specified(), options.specified()]
    return key_of(options_of_both, recipe.generator, arguments, *map(_sha256, files))


def _sha256(path: Path) -> str:
    with open(readable_file(path), "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _remedy(name: str) -> str:
    if name == "coherence_width":  # which scenes have as a parameter of their own
        return "leave it out, or say coherence_width=auto"
    return "leave it out"


def _check_agreement(
    path: Path, table: DiffractionTable, options: LoadOptions, asked: Mapping[str, Any]
) -> None:
    """Refuse parameters of a scene that contradict its table, which fixes them."""
    tabulated = {
        "coherence_width": table.coherence_width,
        "coherence": table.coherence,
        "basis": table.expansion.basis,
        "tolerance": table.tolerance,
        "terms": table.expansion.terms,
        "windows": table.settings.windows,
    }
    asked = dict(asked)
    if asked.pop("second_order", None) is True and table.slope_ratios is None:
        raise DiffractionError(
            f"second_order=true needs slope ratios, which the table '{path}' does not hold; leave "
            "it out, or build the table with second_order=true, for coherence='ensemble'"
        )
    for name, value in asked.items():
        if value != tabulated[name] and not (name == "basis" and value == "auto"):
            raise DiffractionError(
                f"{name}={value} contradicts the table '{path}', which has "
                f"{name}={tabulated[name]}; {_remedy(name)}, or build another table with "
                f"DiffractionTable.build({name}={value})"
            )
    for name, value in options.specified().items():
        raise DiffractionError(
            f"{name}={value} is for height fields, but '{path}' is a table and has its own; "
            f"leave {name} out, or say 'auto'"
        )
    if not mi.is_monochromatic and table.wavelength_range[0] > SHORTEST_WAVELENGTH:
        raise DiffractionError(
            f"the table '{path}' starts at {table.wavelength_range[0]:g} nm, but Mitsuba renders "
            f"from {SHORTEST_WAVELENGTH:g} nm on; build it with "
            "DiffractionTable.build(wavelength_range=(360, 830))"
        )
