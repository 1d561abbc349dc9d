"""Damaged and hostile tables: refused in one line, or harmless wherever they are looked up."""

from __future__ import annotations

import multiprocessing
import os
import random
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable
from tests.support import looked_up
from tests.support.damage import mutate
from tests.support.directions import rough_patch
from tests.support.table_files import Contents

#: Tables and files of each kind; `MITSUBA_DIFFRACTION_DAMAGE=10000` for as many as one likes.
TRIALS = int(os.environ.get("MITSUBA_DIFFRACTION_DAMAGE", "80"))
PATCH = rough_patch((20, 24), (0.08, 0.09), 0.15)
#: Seconds after which a child counts as hung; it takes a few where it compiles on a busy machine.
HANGS = 120
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


def test_nests_of_brackets_and_long_numbers_are_refused(file, tmp_path, used):
    content = file.read_bytes()
    begin = content.index(b'{"version"')
    for text in (b"[" * 3000, b"9" * 6000):
        if len(text) < len(content) - begin - 1000:
            changed = content[:begin] + text + content[begin + len(text) :]
            (tmp_path / "changed.exr").write_bytes(changed)
            assert used(tmp_path / "changed.exr") is None
