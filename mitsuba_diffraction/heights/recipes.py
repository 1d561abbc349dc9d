"""Recipes: TOML files that say where heights come from and how their table is built.

    source = "../scans/elaphe.png"      # or generator = "blazed" with [arguments]
    pixel_size = 0.0488                 # µm, where the source does not say; or [dx, dy]
    max_height = 0.375                  # µm, white of an image
    level = "plane"                     # and channel, crop, ... as in HeightField.load
    tolerance = 1e-3                    # and other parameters of DiffractionTable.build
    output = "tables/elaphe.exr"

Several patches of one surface, whose powers one table averages, are a list of sources, or
`seeds = [1, 2, 3]` for a generator. Paths are relative to the recipe.
"""

from __future__ import annotations

import inspect
import json
import shlex
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, check_keys
from ..files import FileKind, kind_of, path_beside, read_toml
from ..limits import MOST_PATCHES, check_count
from ..retired import retired
from ..settings import RECIPE_SETTINGS, checked
from . import gratings
from .read import LoadOptions

LOAD_KEYS = tuple(option.name for option in fields(LoadOptions))
_OWN_KEYS = ("source", "generator", "arguments", "seeds", "output")
_KEYS = (*_OWN_KEYS, *LOAD_KEYS, *RECIPE_SETTINGS)
#: `method` of recipes of solved orders, which the room `solve` reads.
SOLVED = "solved"
#: Options of files, refused beside a generator.
SOURCE_ONLY = ("pixel_size", "max_height", "height_unit", "channel", "fill")


def read_recipe(file: Path, how: LoadOptions) -> dict[str, Any]:
    """Read and check a recipe; return the attributes of its `Source`, without heights.

    how : options that precede the recipe's.

    Raises a DiffractionError if the file cannot be read, is not TOML, has a key that is unknown, of
    the wrong type or contradicted by another or by an option, or names a generator that does not
    exist; if it is a recipe of solved orders, which the room `solve` reads.
    """
    shown = repr(str(file))
    content = read_toml(file)
    if content.get("method") == SOLVED:
        raise DiffractionError(
            f"{shown} is a recipe of solved orders: run the command 'solve "
            f"{shlex.quote(str(file))}', and give the table (.nc) that it writes"
        )
    for key in retired(content, shown):
        del content[key]
    check_keys(shown, content, _KEYS)
    if ("source" in content) == ("generator" in content):
        raise DiffractionError(
            f"{shown} needs either source, a file, or generator, one of "
            f"{', '.join(gratings.__all__)}"
        )
    options, settings = options_and_settings(content, shown)
    options = options.updated(how)
    if "generator" in content:
        for key in SOURCE_ONLY:
            if getattr(options, key) is not None:
                raise DiffractionError(
                    f"{shown} makes its heights with {content['generator']!r}; {key} contradicts "
                    "it: change the recipe's [arguments] instead"
                )
    files = _sources(content, file, shown) if "source" in content else ()
    arguments = () if files else _arguments(content, shown)
    return {
        "path": file, "files": files, "options": options, "generator": content.get("generator"),
        "arguments": arguments, "settings": settings, "output": _output(content, file, shown),
    }  # fmt: skip


def recipe_text(content: Mapping[str, Any], comment: str) -> str:
    """Return the text of a recipe with these values; `comment` stands above it."""
    lines = [f"# {line}" for line in comment.splitlines()]
    tables = {name: value for name, value in content.items() if isinstance(value, dict)}
    lines += [f"{name} = {_toml(content[name])}" for name in content if name not in tables]
    for name, table in tables.items():
        lines += ["", f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    """A TOML value: a string, a boolean, a number or a list of these."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    # JSON's strings, booleans and finite numbers are TOML's
    return json.dumps(value, ensure_ascii=False)


def options_and_settings(
    content: Mapping[str, Any], where: str
) -> tuple[LoadOptions, dict[str, Any]]:
    """Check the reading options and the fields of `TableSettings` in a recipe's content."""
    try:
        options = LoadOptions.parse(**{key: content[key] for key in LOAD_KEYS if key in content})
        return options, {k: checked(k, content[k]) for k in RECIPE_SETTINGS if k in content}
    except DiffractionError as error:
        raise DiffractionError(f"{where}: {error}") from error


def _sources(content: Mapping[str, Any], file: Path, shown: str) -> tuple[Path, ...]:
    """Return the paths of the files of heights, relative to the recipe's folder."""
    for key in ("arguments", "seeds"):
        if key in content:
            raise DiffractionError(
                f"{shown}: {key} is for a generator, and source is a file; leave {key} out"
            )
    source = content["source"]
    names = source if isinstance(source, list) else [source]
    if not names or not all(isinstance(name, str) and name for name in names):
        raise DiffractionError(
            f"{shown}: source: expected a path, or a list of paths, got {source!r}"
        )
    check_count(len(names), MOST_PATCHES, shown, "sources")
    for name in names:
        if kind_of(file.parent / name) is FileKind.RECIPE:
            raise DiffractionError(f"{shown}: source: {name!r} is a recipe; name a file of heights")
    return tuple(file.parent / name for name in names)


def _arguments(content: Mapping[str, Any], shown: str) -> tuple[Mapping[str, Any], ...]:
    """Check the generator and return its keyword arguments, one mapping for each patch."""
    name = content["generator"]
    if not isinstance(name, str) or name not in gratings.__all__:
        raise DiffractionError(
            f"{shown}: generator: expected one of {', '.join(gratings.__all__)}, got {name!r}"
        )
    arguments = content.get("arguments", {})
    if not isinstance(arguments, dict):
        raise DiffractionError(f"{shown}: arguments: expected a table [arguments]")
    parameters = inspect.signature(getattr(gratings, name)).parameters
    check_keys(f"{shown}: [arguments] of {name!r}", arguments, [*parameters])
    for key, parameter in parameters.items():
        if parameter.default is parameter.empty and key not in arguments:
            raise DiffractionError(f"{shown}: [arguments]: {name!r} needs {key!r}")
    if "seeds" not in content:
        return (arguments,)
    seeds = content["seeds"]
    whole = isinstance(seeds, list) and all(type(s) is int and s >= 0 for s in seeds)
    if not whole or not seeds or len(set(seeds)) < len(seeds):
        raise DiffractionError(
            f"{shown}: seeds: expected a list of different whole numbers, got {seeds!r}"
        )
    check_count(len(seeds), MOST_PATCHES, shown, "seeds")
    if "seed" not in parameters or "seed" in arguments:
        why = "seed is set, too" if "seed" in arguments else f"{name!r} has no parameter seed"
        raise DiffractionError(f"{shown}: seeds: {why}; leave one out")
    return tuple({**arguments, "seed": seed} for seed in seeds)


def _output(content: Mapping[str, Any], file: Path, shown: str) -> Path:
    """Return the path of the recipe's table."""
    if "output" not in content:
        return Path(f"{file.stem}.exr")
    output = content["output"]
    if not isinstance(output, str) or Path(output).suffix.lower() != ".exr":
        raise DiffractionError(
            f"{shown}: output: expected a path that ends in .exr, got {output!r}"
        )
    return path_beside(file, output, output=True)
