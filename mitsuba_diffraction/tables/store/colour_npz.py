"""Colour tables as NPZ files, for the cache: arrays as they are, the rest as one JSON text."""

from __future__ import annotations

import dataclasses
import json
import zipfile
from pathlib import Path

import numpy as np

from ...atomic import atomic_path
from ..colour.polar import PolarGrid
from ..colour.table import ColourTable
from ..expansion import Expansion

_NUMBERS = ("scale", "radius_end", "sigma")


def save_colours(table: ColourTable, path: Path) -> None:
    """Write a colour table; a file of the same name is replaced."""
    document = {
        "grid": dataclasses.asdict(table.grid),
        "expansion": dataclasses.asdict(table.expansion),
        **{name: getattr(table, name) for name in _NUMBERS},
    }
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(
            file,
            coefficients=table.coefficients,
            order_0=table.order_0,
            document=np.array(json.dumps(document)),
        )


def load_colours(path: Path) -> ColourTable:
    """Read what `save_colours` wrote.

    Raises
    ------
    ValueError, OSError
        If it is damaged.
    """
    try:
        with open(path, "rb") as stream, np.load(stream) as file:
            document = json.loads(str(file["document"]))
            grid = document["grid"]
            return ColourTable(
                grid=PolarGrid(grid["smallest"], grid["step"], tuple(grid["counts"])),
                expansion=Expansion(**document["expansion"]),
                coefficients=file["coefficients"],
                order_0=file["order_0"],
                **{name: document[name] for name in _NUMBERS},
            )
    except (KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"'{path}' is a damaged colour table: {error}") from error
