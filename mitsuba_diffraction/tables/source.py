"""Tables of heights, each built once and kept in the cache; tables from files, each loaded once."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable
from dataclasses import asdict

from ..settings import TableSettings
from .store import cached, key_of, loaded_once
from .table import FORMAT_VERSION, DiffractionTable

_tables: weakref.WeakValueDictionary[str, DiffractionTable] = weakref.WeakValueDictionary()


def table_key(digest: str, settings: TableSettings) -> str:
    """Return the key of the table of heights with this digest, built with these settings."""
    return key_of(FORMAT_VERSION, digest, asdict(settings))


def cached_table(
    digest: str, settings: TableSettings, build: Callable[[], DiffractionTable]
) -> DiffractionTable:
    """Return the table of heights with this digest, from memory, from disk, or built and stored."""
    key = table_key(digest, settings)
    return cached("table", key, _tables, build, DiffractionTable)


def loaded_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """Load a table file once for all that use it at the same time."""
    return loaded_once(path, DiffractionTable.load, _tables)
