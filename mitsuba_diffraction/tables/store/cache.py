"""Tables and their colours, each made once and found by its content."""

from __future__ import annotations

import json
import os
import weakref
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from ...heights.validity import TEXTS_VERSION
from ...settings import TableSettings
from ..build import coarse
from ..colour.polar import PolarGrid
from ..colour.table import COLOUR_VERSION, ColourTable
from ..document import described, document_of, plain
from ..expansion import Expansion
from ..table import FORMAT_VERSION, DiffractionTable
from .store import Record, kept, key_of

_tables: weakref.WeakValueDictionary[str, DiffractionTable] = weakref.WeakValueDictionary()
_colours: weakref.WeakKeyDictionary[DiffractionTable, dict[str, ColourTable]] = (
    weakref.WeakKeyDictionary()
)
_COLOUR_NUMBERS = ("scale", "radius_end", "sigma")


def table_key(digest: str, settings: TableSettings) -> str:
    """Name of the table of heights with this digest, built with these settings."""
    cells: tuple[float, ...] = ()
    if settings.q_max or settings.kappa_max:  # it goes on in cells that no setting tells of
        cells = (coarse.CELL, coarse.FEWEST, coarse.STEP, coarse.TOLERANCE)
    return key_of(FORMAT_VERSION, TEXTS_VERSION, digest, asdict(settings), cells)


def cached_table(
    digest: str, settings: TableSettings, build: Callable[[], DiffractionTable]
) -> DiffractionTable:
    """The table for heights with this digest, from memory, from disk, or built and kept."""
    key = table_key(digest, settings)
    return kept("table", key, _tables, build, _table_record, _table_of)


def _table_record(table: DiffractionTable) -> Record:
    document = json.loads(json.dumps(document_of(table), default=plain))
    return Record(document, [part.coefficients for part in table.parts])


def _table_of(record: Record) -> DiffractionTable:
    found = described(record.document)
    shapes = [part.shape for part in found.parts]
    if [array.shape for array in record.arrays] != shapes:
        raise ValueError(f"arrays of other shapes than {shapes}")
    return found.table(record.arrays)


def loaded_table(path: str | os.PathLike[str]) -> DiffractionTable:
    """`DiffractionTable.load`, once for all that use the same file at the same time."""
    try:
        status = os.stat(path)
    except OSError:
        return DiffractionTable.load(path)  # which says what is wrong
    key = f"{Path(path).resolve()} {status.st_mtime_ns} {status.st_size}"
    table = _tables.get(key)
    if table is None:
        table = _tables.setdefault(key, DiffractionTable.load(path))
    return table


def cached_colours(table: DiffractionTable) -> ColourTable:
    """The colours of a table, from memory, from disk, or summed and kept."""
    key = key_of(COLOUR_VERSION, table.digest())
    memory = _colours.setdefault(table, {})
    return kept("colours", key, memory, lambda: ColourTable.build(table), colour_record, colours_of)


def colour_record(colours: ColourTable) -> Record:
    """What a file keeps of colours."""
    document = {
        "grid": asdict(colours.grid),
        "expansion": asdict(colours.expansion),
        **{name: getattr(colours, name) for name in _COLOUR_NUMBERS},
    }
    return Record(document, [colours.coefficients, colours.order_0])


def colours_of(record: Record) -> ColourTable:
    """What was made into such a record."""
    document = record.document
    grid = document["grid"]
    coefficients, order_0 = record.arrays
    return ColourTable(
        grid=PolarGrid(grid["smallest"], grid["step"], tuple(grid["counts"])),
        expansion=Expansion(**document["expansion"]),
        coefficients=coefficients,
        order_0=order_0,
        **{name: document[name] for name in _COLOUR_NUMBERS},
    )
