"""The cache: damage is made again, one makes a thing, found by content; never a reason to fail."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

from mitsuba_diffraction import DiffractionError, DiffractionTable, DiffractionWarning, HeightField
from mitsuba_diffraction.progress import silent
from mitsuba_diffraction.settings import TableSettings
from mitsuba_diffraction.tables import TableRequest, TableSource, source, store
from mitsuba_diffraction.tables.store import Record, cache_folder, cached
from tests.support.directions import rough_patch
from tests.support.systems import posix

VALUES = np.linspace(0.0, 1.0, 37, dtype=np.float32).reshape(1, 37)
KEY = "3" * 64
#: Every byte of a file is flipped in this many places; more with the variable.
FLIPS = int(os.environ.get("MITSUBA_DIFFRACTION_DAMAGE", 150))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """An empty cache, on disk and in memory."""
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "cache"))
    source._tables.clear()
    return tmp_path / "cache"


class Stored(tuple):
    """A text and arrays."""


def pack(value):
    return Record({"text": value[0]}, value[1:])


def unpack(record):
    return Stored((record.document["text"], *record.arrays))


def get(made, key=KEY, kind="values"):
    """VALUES with a text, counted in `made` where they are made."""

    def make():
        made.append(key)
        return Stored(("a text", VALUES, VALUES[0].astype(np.float16)))

    return cached(kind, key, {}, make, pack, unpack)


def test_a_later_process_reads_the_same_numbers(folder):
    made = []
    first, second = get(made), get(made)
    assert made == [KEY]
    assert first[0] == second[0]
    for before, after in zip(first[1:], second[1:], strict=True):
        assert before.dtype == after.dtype
        np.testing.assert_array_equal(before, after)
    assert [path.suffix for path in folder.iterdir()] == [".cache"]


def test_any_damage_is_made_again_with_one_line(folder):
    get([])
    (file,) = folder.iterdir()
    content = file.read_bytes()
    rng = np.random.default_rng(5)
    for _ in range(FLIPS):
        damaged = bytearray(content)
        kind = rng.integers(3)
        if kind == 0:
            damaged[rng.integers(len(damaged))] ^= 1 << rng.integers(8)
        elif kind == 1:
            damaged = damaged[: rng.integers(len(damaged))]
        else:
            damaged += rng.bytes(int(rng.integers(1, 200)))
        file.write_bytes(damaged)
        made = []
        with pytest.warns(DiffractionWarning, match="is damaged") as said:
            found = get(made)
        assert len(said) == 1
        assert "\n" not in str(said[0].message)
        assert made == [KEY]
        np.testing.assert_array_equal(found[1], VALUES)
        assert file.read_bytes() == content


@pytest.mark.parametrize(("kind", "key"), [("values", "4" * 64), ("numbers", KEY)])
def test_a_file_under_another_s_name_is_made_again(folder, kind, key):
    get([])
    (file,) = folder.iterdir()
    file.rename(folder / f"{kind}-{key[:32]}.cache")
    made = []
    with pytest.warns(DiffractionWarning, match="another's"):
        get(made, key=key, kind=kind)
    assert made == [key]


@posix
def test_without_a_home_there_is_no_cache_and_no_error(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in (store.VARIABLE, "HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pwd.getpwuid", lambda _: {}["nobody"])
    assert cache_folder() is None
    made = []
    np.testing.assert_array_equal(get(made)[1], VALUES)
    assert made == [KEY]
    assert os.listdir(tmp_path) == []


def test_the_folder_is_the_variable_s_or_the_user_s(monkeypatch):
    monkeypatch.setenv(store.VARIABLE, "/somewhere/else")
    assert cache_folder() == Path("/somewhere/else")
    monkeypatch.delenv(store.VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", "/home/someone/.cache")
    assert cache_folder() == Path("/home/someone/.cache/mitsuba_diffraction")


KILLED = """
import os, pathlib, signal, sys
from mitsuba_diffraction.atomic import atomic_path

for name in sys.argv[1:]:
    if os.fork() == 0:
        with atomic_path(pathlib.Path(name)) as temporary:
            temporary.write_bytes(b"half")
            os.kill(os.getpid(), signal.SIGKILL)
    os.wait()
"""


def child(*arguments):
    """Run a program of its own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", *arguments], env=environment, timeout=120, check=True)


@posix
def test_what_a_killed_process_left_is_removed(folder):
    get([])
    (file,) = folder.iterdir()
    child(KILLED, str(folder / "values-other.cache"), str(file))
    assert len(list(folder.iterdir())) == 3
    get([], key="5" * 64)
    assert len([path for path in folder.iterdir() if path.name.startswith(".")]) == 0
    assert len(list(folder.iterdir())) == 2


def test_another_process_that_makes_it_is_named_after_a_while(folder, monkeypatch):
    """A lock that nobody releases would look like a command that hangs."""
    monkeypatch.setattr(store, "PATIENCE", 0.05)
    path = folder / f"values-{KEY[:32]}.lock"
    folder.mkdir()
    held, over = threading.Event(), threading.Event()

    def hold():
        with FileLock(path):
            held.set()
            over.wait(0.5)

    other = threading.Thread(target=hold)
    other.start()
    held.wait()
    made = []
    with pytest.warns(DiffractionWarning, match="another process holds"):
        get(made)
    other.join()
    assert made == [KEY]


PATCH = rough_patch((20, 20), (0.08, 0.08), 0.1)
ARGUMENTS = {"coherence_width": 1.6}


class Builder:
    """Counts how often a table is built."""

    def __init__(self, heights=PATCH, **arguments):
        self.heights, self.arguments, self.built = heights, arguments or ARGUMENTS, 0

    def __call__(self):
        self.built += 1
        return DiffractionTable.build(self.heights, **self.arguments)

    def table(self):
        builder, settings = self, TableSettings(**self.arguments)

        class Counted(TableRequest):
            def built(self, settings):
                return builder()

        request = Counted(TableSource.of(self.heights), settings, 1.0, 1.0, silent)
        return request.cached(settings)


def test_a_later_process_reads_it_from_disk_under_its_own_name(folder):
    """The cache keeps no name of a file: a reader of equal heights gets the own file's name."""
    first = Builder(dataclasses.replace(PATCH, name="secret.npy")).table()
    (file,) = folder.iterdir()
    assert b"secret" not in file.read_bytes()
    source._tables.clear()  # as in a process of its own
    build = Builder(dataclasses.replace(PATCH, name="copy.npy"))
    second = build.table()
    assert second.source["name"] == "copy.npy"
    assert build.built == 0
    assert np.array_equal(first.coefficients, second.coefficients)


def test_tables_of_another_format_are_built_anew(monkeypatch):
    build = Builder()
    build.table()
    source._tables.clear()
    monkeypatch.setattr(source, "FORMAT_VERSION", 99)
    build.table()
    assert build.built == 2


def test_a_cache_that_cannot_be_written_is_no_reason_to_fail(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "file" / "cache"))
    build = Builder()
    first = build.table()
    assert build.table() is first  # kept in memory all the same
    source._tables.clear()
    build.table()
    assert build.built == 2


def test_a_table_that_cannot_be_built_leaves_nothing(folder):
    with pytest.raises(DiffractionError, match="taps=1 leave an error"):
        Builder(coherence_width=1.6, taps=1).table()
    assert list(folder.iterdir()) == []


def test_the_oldest_tables_go_when_the_folder_is_full(folder, monkeypatch):
    builders = [Builder(coherence_width=1.6 + 0.001 * n) for n in range(4)]  # of one size
    files = []
    for age, build in enumerate(builders[:3]):
        build.table()
        (new,) = set(folder.iterdir()) - set(files)
        files.append(new)
        os.utime(new, (1000 + age, 1000 + age))
    source._tables.clear()
    builders[0].table()  # found, which makes it the youngest
    assert builders[0].built == 1
    monkeypatch.setattr(store, "MAX_BYTES", int(3.5 * files[0].stat().st_size))
    builders[3].table()
    left = set(folder.iterdir())
    assert files[1] not in left
    assert {files[0], files[2]} < left
    assert len(left) == 3


def test_the_newest_table_stays_however_large_and_other_files_are_left_alone(folder, monkeypatch):
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    monkeypatch.setattr(store, "MAX_BYTES", 1)
    Builder().table()
    Builder(coherence_width=1.7).table()
    assert len(list(folder.iterdir())) == 2
    assert (folder / "notes.txt").read_text() == "mine"


def test_threads_that_need_the_same_table_build_it_once():
    build = Builder()
    tables = []
    threads = [
        threading.Thread(target=lambda: tables.append(build.table()), daemon=True) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert build.built == 1
    assert len({id(table) for table in tables}) == 1


def test_a_table_s_file_is_read_once_while_in_use(tmp_path):
    file = tmp_path / "table.exr"
    DiffractionTable.build(PATCH, **ARGUMENTS).save(file)
    first = source.loaded_table(file)
    assert source.loaded_table(str(file)) is first
    DiffractionTable.build(PATCH, coherence_width=1.7).save(file)
    assert source.loaded_table(file).coherence_width == 1.7
    with pytest.raises(DiffractionError, match="does not exist"):
        source.loaded_table(tmp_path / "no.exr")


def test_a_digest_is_of_what_is_looked_up_alone():
    table = DiffractionTable.build(PATCH, **ARGUMENTS)
    same = HeightField(PATCH.heights.copy(), PATCH.pixel_size, name="another name")
    assert DiffractionTable.build(same, **ARGUMENTS).digest() == table.digest()
    other = table.coefficients.copy()
    other[0, 3, 3, 0, 0] += 1.0
    for changed in (
        dataclasses.replace(table, coefficients=other),
        dataclasses.replace(table, order_0=table.order_0 + 1e-9),
        dataclasses.replace(table, scale=2.0 * table.scale),
        dataclasses.replace(table, roughness=dataclasses.replace(table.roughness, first=-3.0)),
    ):
        assert changed.digest() != table.digest()


def test_each_setting_and_the_heights_make_another_key(monkeypatch):
    keys = []
    monkeypatch.setattr(source, "cached", lambda kind, key, *more: keys.append(key))
    monkeypatch.setattr(source, "named", lambda table, names: table)
    names = [field.name for field in dataclasses.fields(TableSettings)]
    for name in (None, *names):
        settings = TableSettings()
        if name is not None:
            object.__setattr__(settings, name, "another")  # whatever may be asked for
        TableRequest(TableSource.of(PATCH), settings, 1.0, 1.0, silent).cached(settings)
    settings, other = TableSettings(), TableSource.of(rough_patch((8, 8), (0.1, 0.1), 0.1))
    TableRequest(other, settings, 1.0, 1.0, silent).cached(settings)
    assert len(set(keys)) == len(names) + 2
