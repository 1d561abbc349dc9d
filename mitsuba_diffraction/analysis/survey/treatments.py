"""How the files of a survey are read and treated: a TOML file of patterns, each with its options.

    ["snakes/*.png"]
    pixel_size = 0.0488
    max_height = 0.375
    level = "plane"

Patterns are matched with the whole path and with the file's name; of several that match, later ones
override. Keys are those of recipes.
"""

from __future__ import annotations

import fnmatch
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...errors import DiffractionError, one_line
from ...heights.read import LoadOptions
from ...heights.recipes import LOAD_KEYS
from ...settings import RECIPE_SETTINGS, checked


@dataclass(frozen=True)
class Treatment:
    """How one file is read, and what its table is built with."""

    options: LoadOptions = field(default_factory=LoadOptions)
    settings: Mapping[str, Any] = field(default_factory=dict)

    def updated(self, other: Treatment) -> Treatment:
        """This one, with what `other` sets in its place."""
        return Treatment(self.options.updated(other.options), {**self.settings, **other.settings})


def treatments_of(
    path: str | os.PathLike[str] | None,
) -> Sequence[tuple[str, Treatment]]:
    """The patterns of a file, in its order; none without one.

    Raises
    ------
    DiffractionError
        If the file cannot be read, or a pattern has an option that does not fit.
    """
    if path is None:
        return []
    try:
        content = tomllib.loads(Path(path).read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise DiffractionError(f"cannot read '{path}': {one_line(str(error))}") from error
    return [(pattern, _treatment(f"'{path}': [{pattern!r}]", v)) for pattern, v in content.items()]


def treatment_for(file: Path, treatments: Sequence[tuple[str, Treatment]]) -> Treatment:
    """What the patterns that match a file say of it."""
    result = Treatment()
    for pattern, treatment in treatments:
        if fnmatch.fnmatch(str(file), pattern) or fnmatch.fnmatch(file.name, pattern):
            result = result.updated(treatment)
    return result


def _treatment(where: str, values: Any) -> Treatment:
    if not isinstance(values, dict):
        raise DiffractionError(f"{where}: expected a pattern in brackets with options below it")
    unknown = set(values) - {*LOAD_KEYS, *RECIPE_SETTINGS}
    if unknown:
        raise DiffractionError(
            f"{where}: unknown key {min(unknown)!r}; known are "
            f"{', '.join((*LOAD_KEYS, *RECIPE_SETTINGS))}"
        )
    try:
        return Treatment(
            LoadOptions.of(**{k: v for k, v in values.items() if k in LOAD_KEYS}),
            {k: checked(k, v) for k, v in values.items() if k in RECIPE_SETTINGS},
        )
    except DiffractionError as error:
        raise DiffractionError(f"{where}: {error}") from error
