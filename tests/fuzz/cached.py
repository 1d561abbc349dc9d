"""Damaged files of the cache: whatever was in them comes back as it was, after one line at most."""

from __future__ import annotations

import functools
import os
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.colour import ColourTable
from mitsuba_diffraction.tables.directional import DirectionalTable
from mitsuba_diffraction.tables.document import from_record, to_record
from mitsuba_diffraction.tables.energy.conservation import Conservation
from mitsuba_diffraction.tables.store import VARIABLE, Record, cached
from tests.fuzz.damage import damaged
from tests.support.directions import rough_patch

_KEY = "5" * 64


@dataclass(frozen=True)
class Kind:
    """What is kept: how it is made, packed and unpacked."""

    make: Callable[[], Any]
    pack: Callable[[Any], Record]
    unpack: Callable[[Record], Any]


def _table() -> md.DiffractionTable:
    return md.DiffractionTable.build(rough_patch((8, 10), (0.2, 0.2), 0.05), coherence_width=1.5)


@functools.cache
def _colours() -> Any:
    return ColourTable.build(_table())


def _conservation() -> Conservation:
    values = np.random.default_rng(3).random((2, 5, 4)).astype(np.float32)
    return Conservation(DirectionalTable(np.array([400.0, 700.0]), values))


KINDS = {
    "table": Kind(_table, to_record, from_record),
    "colours": Kind(_colours, ColourTable.to_record, ColourTable.from_record),
    "energy": Kind(_conservation, Conservation.to_record, Conservation.from_record),
}


@functools.cache
def originals() -> dict[str, tuple[str, bytes]]:
    """Name and content of a whole file of each kind."""
    found = {}
    for name in KINDS:
        with tempfile.TemporaryDirectory() as folder:
            _get(name, folder)
            (file,) = Path(folder).iterdir()
            found[name] = (file.name, file.read_bytes())
    return found


@functools.cache
def _expected(name: str) -> Record:
    return KINDS[name].pack(KINDS[name].make())


def _get(name: str, folder: str) -> tuple[Record, int]:
    """What is kept in a folder, as a record, and how often it was made."""
    kind, made = KINDS[name], []

    def make() -> Any:
        made.append(name)
        return kind.make()

    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = folder
    try:
        kept = cached(name, _KEY, {}, make, kind.pack, kind.unpack)
        return kind.pack(kept), len(made)
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def check(rng: np.random.Generator) -> None:
    """Damage one, or put another's content under its name, and ask for it."""
    # colours are large and tables what is most in a cache
    name = str(rng.choice(list(KINDS), p=[0.7, 0.05, 0.25]))
    file, content = originals()[name]
    changed = _other(rng, content)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        path = Path(folder, file)
        path.write_bytes(changed)
        found, made = _get(name, folder)
        assert path.read_bytes() == content, "not written again"
    assert made == (changed != content), f"made {made} times"
    lines = [str(line.message) for line in said if line.category is md.DiffractionWarning]
    # what is made again says what else it doubts
    assert sum("in the cache is damaged" in line for line in lines) == made
    assert all(len(line) < 500 and "\n" not in line for line in lines)
    expected = _expected(name)
    assert found.document == expected.document
    for one, other in zip(found.arrays, expected.arrays, strict=True):
        np.testing.assert_array_equal(one, other)


def _other(rng: np.random.Generator, content: bytes) -> bytes:
    kind = rng.integers(10)
    if kind == 0:
        return originals()[str(rng.choice(list(KINDS)))][1]
    if kind == 1:
        return content + rng.bytes(int(rng.integers(1, 200)))
    if kind == 2:
        return content.replace(_KEY.encode(), b"4" * 64)
    return damaged(rng, content)
