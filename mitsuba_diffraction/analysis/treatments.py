"""Options to read scans, and settings of their tables, by patterns of file names.

A TOML file of patterns selects reading options and treatments:

    ["snakes/*.png"]
    pixel_size = 0.0488
    max_height = 0.375
    level = "plane"

Patterns are matched with the whole path and with the file's name. Where several match, later ones
override earlier ones. Keys are the keys of recipes.
"""

from __future__ import annotations

import fnmatch
import functools
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, check_keys
from ..files import read_toml
from ..heights import LoadOptions
from ..heights.recipes import LOAD_KEYS, options_and_settings
from ..retired import retired
from ..settings import RECIPE_SETTINGS


@dataclass(frozen=True)
class Treatment:
    """Options to read a file, and settings of its table."""

    options: LoadOptions = field(default_factory=LoadOptions)
    settings: Mapping[str, Any] = field(default_factory=dict)

    def updated(self, other: Treatment) -> Treatment:
        """Return this treatment with the values that `other` sets."""
        return Treatment(self.options.updated(other.options), {**self.settings, **other.settings})


def load_treatments(
    path: str | os.PathLike[str] | None = None, common: Treatment | None = None
) -> Callable[[Path], Treatment]:
    """Return the function that gives a file's treatment, of all patterns that match its name.

    path : TOML file of patterns, or None.
    common : treatment of all files, which takes precedence.

    Raises a DiffractionError if the file cannot be read, or a pattern has an option without a valid
    value.
    """
    content = {} if path is None else read_toml(path)
    treatments = [(name, _treatment(f"'{path}': [{name!r}]", v)) for name, v in content.items()]

    def of_file(file: Path) -> Treatment:
        matching = (
            treatment for name, treatment in treatments
            if fnmatch.fnmatch(str(file), name) or fnmatch.fnmatch(file.name, name)
        )  # fmt: skip
        return functools.reduce(Treatment.updated, (*matching, common or Treatment()), Treatment())

    return of_file


def _treatment(where: str, values: Any) -> Treatment:
    """Check the options of one pattern."""
    if not isinstance(values, dict):
        raise DiffractionError(f"{where}: expected a section such as ['*.spm'] with options")
    for key in retired(values, where):
        del values[key]
    check_keys(where, values, (*LOAD_KEYS, *RECIPE_SETTINGS))
    return Treatment(*options_and_settings(values, where))
