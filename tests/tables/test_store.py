"""The cache's files: what is damaged is made again, one makes it, nothing is left behind."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

from mitsuba_diffraction import DiffractionWarning
from mitsuba_diffraction.tables import store
from mitsuba_diffraction.tables.store import Record, cache_folder, cached
from tests.support.systems import posix

VALUES = np.linspace(0.0, 1.0, 37, dtype=np.float32).reshape(1, 37)
KEY = "3" * 64
#: Every byte of a file is flipped in this many places; more with the variable.
FLIPS = int(os.environ.get("MITSUBA_DIFFRACTION_DAMAGE", 150))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """An empty cache."""
    monkeypatch.setenv(store.VARIABLE, str(tmp_path / "cache"))
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


MANY = """
import os, sys, time
import numpy as np
from mitsuba_diffraction.tables.store import Record, cached

def make():
    with open(sys.argv[1], "a") as file:
        file.write("made ")
    time.sleep(0.3)
    return Stored()

class Stored:
    pass

def pack(value):
    return Record(None, [np.arange(5)])

def unpack(record):
    assert record.arrays[0].sum() == 10
    return Stored()

children = []
while len(children) < 7:
    child = os.fork()
    if child == 0:
        children.clear()
        break
    children.append(child)
found = cached("values", "k", {}, make, pack, unpack)
for child in children:
    assert os.waitpid(child, 0)[1] == 0
os._exit(0 if isinstance(found, Stored) else 1)
"""
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
def test_of_eight_processes_one_makes_it(tmp_path, folder):
    child(MANY, str(tmp_path / "log"))
    assert (tmp_path / "log").read_text() == "made "
    assert [path.suffix for path in folder.iterdir()] == [".cache"]


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
