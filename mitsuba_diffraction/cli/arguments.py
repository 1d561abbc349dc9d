"""Files that a command line names, noted before the work: no output may replace one."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..scene.parameters import note_files

#: Values in `args` that name outputs.
OUTPUTS = ("output", "json", "addon")


def note_arguments(args: argparse.Namespace) -> None:
    """Note each file that an argument names, and all that a scene or a recipe among them names.

    Names also stand behind "=" and between commas, as in ID=FILE,NAME=VALUE.
    """
    parameters = {name: str(value) for name, value in getattr(args, "parameters", None) or ()}
    for name, value in vars(args).items():
        if name not in OUTPUTS:
            for text in dict.fromkeys(_texts(value)):
                if os.path.isfile(text):
                    note_files(Path(text), parameters)


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts that may name a file."""
    if isinstance(value, (list, tuple)):
        for item in value:
            yield from _texts(item)
    elif isinstance(value, (str, Path)):
        text = str(value)
        yield text
        for part in text.split(","):
            yield part
            yield part.rpartition("=")[2]
