"""Tables built from height fields given straight to the plugin: built once, found by content."""

from __future__ import annotations

import hashlib
import json
import os
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError
from ...heights.validity import TEXTS_VERSION
from ..build import coarse
from ..colour.table import COLOUR_VERSION, ColourTable
from ..table import FORMAT_VERSION, DiffractionTable
from .colour_npz import load_colours, save_colours

#: Environment variable that moves the cache, e.g. to a larger disk.
VARIABLE = "MITSUBA_DIFFRACTION_CACHE"
#: The oldest tables go when the folder is larger than this.
MAX_BYTES = 4 << 30

_open_tables: weakref.WeakValueDictionary[str, DiffractionTable] = weakref.WeakValueDictionary()
_colours: weakref.WeakKeyDictionary[DiffractionTable, ColourTable] = weakref.WeakKeyDictionary()
_lock = threading.Lock()


def cache_folder() -> Path:
    """Where tables are kept: $MITSUBA_DIFFRACTION_CACHE, or the user's cache folder."""
    own = os.environ.get(VARIABLE)
    if own:
        return Path(own)
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "mitsuba_diffraction"


def content_key(digest: str, arguments: dict[str, Any]) -> str:
    """Name of the table of heights with this digest, built with these arguments."""
    content: list[Any] = [FORMAT_VERSION, digest, sorted(arguments.items())]
    if {"crop", "kappa_max"} & arguments.keys():  # it goes on in cells that no argument tells of
        content.append([coarse.CELL, coarse.FEWEST, coarse.STEP, coarse.TOLERANCE])
    return hashlib.sha256(json.dumps(content, default=list).encode()).hexdigest()[:32]


def cached_table(
    digest: str, arguments: dict[str, Any], build: Callable[[], DiffractionTable]
) -> DiffractionTable:
    """The table for heights with this digest, from memory, from disk, or built and kept.

    A cache that cannot be written is no reason to fail: the table is then built every time.
    """
    key = content_key(digest, arguments)
    path = cache_folder() / f"{key}-{TEXTS_VERSION}.exr"
    with _lock:
        table = _open_tables.get(key)
        if table is None and path.is_file():
            try:
                table = DiffractionTable.load(path)
                os.utime(path)  # recently used ones are kept longest
            except (DiffractionError, OSError):
                table = None  # left by another version or a dying disk: built anew below
        if table is None:
            table = build()
            _keep(lambda: table.save(path), path)
        _open_tables[key] = table
        return table


def loaded_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """`DiffractionTable.load`, once for all that use the same file at the same time."""
    try:
        status = os.stat(path)
        key = f"{Path(path).resolve()} {status.st_mtime_ns} {status.st_size}"
    except OSError:
        return DiffractionTable.load(path)  # which says what is wrong
    with _lock:
        table = _open_tables.get(key)
        if table is None:
            table = DiffractionTable.load(path)
            _open_tables[key] = table
        return table


def cached_colours(table: DiffractionTable) -> ColourTable:
    """The colours of a table, from memory, from disk, or summed and kept."""
    with _lock:
        colours = _colours.get(table)
        if colours is None:
            path = cache_folder() / f"{_colour_key(table)}.npz"
            if path.is_file():
                try:
                    colours = load_colours(path)
                    os.utime(path)
                except (ValueError, OSError):
                    colours = None  # as for diffraction tables
            if colours is None:
                colours = ColourTable.build(table)
                _keep(lambda: save_colours(colours, path), path)
            _colours[table] = colours
        return colours


def _colour_key(table: DiffractionTable) -> str:
    """Name of a table's colours: what they depend on is the table's numbers."""
    plain = (table.scale, table.expansion, table.grid, table.spacing, table.sigma)
    content = hashlib.sha256(repr((COLOUR_VERSION, table.height_scale_max, *plain)).encode())
    content.update(np.ascontiguousarray(table.coefficients).data)
    content.update(np.ascontiguousarray(table.order_0).data)
    return content.hexdigest()[:32]


def _keep(save: Callable[[], None], path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save()
        _prune(path.parent)
    except (DiffractionError, OSError):
        return


def _prune(folder: Path) -> None:
    """Remove the tables unused for longest until the folder is small enough."""
    tables = [*folder.glob("*.exr"), *folder.glob("*.npz")]
    files = sorted(tables, key=lambda p: p.stat().st_mtime, reverse=True)
    total = 0
    for n, path in enumerate(files):
        total += path.stat().st_size
        if total > MAX_BYTES and n > 0:
            path.unlink(missing_ok=True)
