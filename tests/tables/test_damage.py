"""Damaged and hostile tables: refused in one line, or harmless wherever they are looked up."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import tracemalloc
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.files import TABLE_ATTRIBUTE
from mitsuba_diffraction.tables.exr import CHECKSUM, _checksum
from tests.support import looked_up
from tests.support.damage import mutate
from tests.support.directions import rough_patch

#: Tables and files of each kind; `MITSUBA_DIFFRACTION_DAMAGE=10000` for as many as one likes.
TRIALS = int(os.environ.get("MITSUBA_DIFFRACTION_DAMAGE", "80"))
PATCH = rough_patch((20, 24), (0.08, 0.09), 0.15)
#: Seconds after which a child counts as hung; it takes a few where it compiles on a busy machine.
HANGS = 120
#: Bytes: ten times what any takes, and a thousandth of what the damaged ones claim.
MUCH = 1e6
KINDS = {
    "svd": {},
    "patch": {"coherence": "patch"},
    "taylor": {"basis": "taylor"},
    "limited": {"frequency_limit": 12.0},
}


@pytest.fixture(scope="module", params=KINDS)
def file(request, tmp_path_factory) -> Path:
    """A table of each kind, in a file."""
    path = tmp_path_factory.mktemp("tables") / "table.exr"
    DiffractionTable.build(PATCH, coherence_width=1.8, **KINDS[request.param]).save(path)
    return path


@pytest.fixture(scope="module")
def used() -> Iterator[Callable[[Path], tuple[str, dict] | None]]:
    """`looked_up.use` in a process of its own, which damage may end, already started."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as child:
        child.submit(looked_up.start).result(timeout=HANGS)
        yield lambda path: child.submit(looked_up.use, path).result(timeout=HANGS)


class Contents:
    """What is in a table's file, to be changed and written with a checksum that fits."""

    def __init__(self, path: Path) -> None:
        with OpenEXR.File(str(path), separate_channels=True) as exr:
            self.channels = {name: np.array(c.pixels) for name, c in exr.channels().items()}
            self.document = json.loads(exr.header()[TABLE_ATTRIBUTE])

    def write(self, path: Path) -> None:
        """A file that nothing but what it says gives away."""
        text = json.dumps(self.document)
        rows, columns = next(iter(self.channels.values())).shape
        # the order in which a reader goes through the channels
        ordered = {name: self.channels[name] for name in sorted(self.channels, key=_place)}
        header = {
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION,
            "displayWindow": (np.zeros(2, np.int32), np.array([columns - 1, rows - 1], np.int32)),
            TABLE_ATTRIBUTE: text,
            CHECKSUM: _checksum(text, ordered),
        }
        OpenEXR.File(header, self.channels).write(str(path))


def taken_until_refused(path: Path) -> int:
    """Bytes that are taken at most until a table is refused."""
    tracemalloc.start()
    try:
        with pytest.raises(DiffractionError):
            DiffractionTable.load(path)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _place(channel: str) -> tuple[int, bool, int]:
    prefix, interval, term = channel.split(".")
    return int(interval), prefix == "im", int(term)


def _damage(contents: Contents, rng: np.random.Generator) -> None:
    """One or two fields or channels."""
    for _ in range(rng.integers(1, 3)):
        if rng.random() < 0.8:
            mutate(rng, contents.document)
            continue
        plane = contents.channels[str(rng.choice(sorted(contents.channels)))]
        value = rng.choice([np.nan, np.inf, 1e4, -6e4, 0.0, 1.0])
        plane[tuple(rng.integers(plane.shape))] = value


def test_a_table_with_any_field_or_channel_changed_is_refused_or_harmless(file, tmp_path, used):
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(TRIALS // len(KINDS)):
        contents = Contents(file)
        _damage(contents, rng)
        contents.write(tmp_path / "changed.exr")
        refused += used(tmp_path / "changed.exr") is None
    assert refused > 0


def test_a_bit_that_is_flipped_anywhere_is_noticed(file, tmp_path, used):
    content, rng = file.read_bytes(), random.Random(3)
    before = DiffractionTable.load(file)
    text = content.index(b'{"version"')
    changed = tmp_path / "changed.exr"
    for n in range(TRIALS // len(KINDS)):
        # half of them in the attribute, which EXR itself has no checksum of
        place = rng.randrange(len(content)) if n % 2 else text + rng.randrange(2000)
        damaged = bytearray(content)
        damaged[place] ^= 1 << rng.randrange(8)
        changed.write_bytes(damaged)
        assert used(changed) in (None, (before.digest(), before.source))


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d["grid"].update(taps=[4, 1000]),
        lambda d: d["grid"].update(trims=[-1] * d["grid"]["taps"][1]),
        lambda d: d["grid"].update(last=[5000, 5000]),
        lambda d: d["expansion"].update(intervals=1 << 40),
        lambda d: d["expansion"].update(terms=10**9),
        lambda d: d.update(scale=0.0),
        lambda d: d.update(spacing=[0.0, 1.0]),
        lambda d: d.update(order_0=[[[1e30]]]),
        lambda d: d.update(coherence_width=1e300),
    ],
)
def test_what_would_read_outside_or_fill_memory_is_refused_at_once(file, tmp_path, change):
    contents = Contents(file)
    change(contents.document)
    contents.write(tmp_path / "changed.exr")
    assert taken_until_refused(tmp_path / "changed.exr") < MUCH


def test_nests_of_brackets_and_long_numbers_are_refused(file, tmp_path, used):
    content = file.read_bytes()
    begin = content.index(b'{"version"')
    for text in (b"[" * 3000, b"9" * 6000):
        if len(text) < len(content) - begin - 1000:
            changed = content[:begin] + text + content[begin + len(text) :]
            (tmp_path / "changed.exr").write_bytes(changed)
            assert used(tmp_path / "changed.exr") is None


def test_a_small_file_that_claims_gigabytes_is_refused_before_they_are_taken(tmp_path):
    table = DiffractionTable.build(PATCH, coherence_width=1.8)
    table.save(tmp_path / "table.exr")
    contents = Contents(tmp_path / "table.exr")
    last = [1100, 1100]
    contents.document["grid"]["last"] = last
    shape = (2 * last[1] + 1, 2 * last[0] + 1)
    contents.channels = dict.fromkeys(contents.channels, np.zeros(shape, np.float16))
    contents.write(tmp_path / "large.exr")
    assert (tmp_path / "large.exr").stat().st_size < 5e5
    assert taken_until_refused(tmp_path / "large.exr") < MUCH
