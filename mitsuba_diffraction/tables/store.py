"""Cache of what takes long to compute, in files named by a digest of their inputs.

A file is one line with its kind, its key and the SHA-256 of the rest; then JSON and arrays, as
NumPy saves them (NPY). A damaged file, or one under another's name, is rebuilt. Whoever stores
something packs it into a `Record`: this module knows no class.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import threading
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass
from io import BufferedRandom, BufferedReader
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import platformdirs
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from ..atomic import atomic_path, remove_abandoned
from ..errors import DiffractionError, one_line, warn
from ..inputs import note_input

#: Environment variable that moves the cache, e.g. to a larger disk.
VARIABLE = "MITSUBA_DIFFRACTION_CACHE"
#: The files unused for longest go when all are larger than this together.
MAX_BYTES = 4 << 30

#: Seconds after which it is said that another process holds a lock.
PATIENCE = 5.0

SUFFIX = ".cache"
_MAGIC = "mitsuba_diffraction cache"
#: Bytes that the first line is filled up to.
_HEAD = 256

T = TypeVar("T")
_making: dict[tuple[str, str], threading.Lock] = {}


def cache_folder() -> Path | None:
    """Return $MITSUBA_DIFFRACTION_CACHE, or the user's cache folder; None without a home."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Path(chosen)
    try:
        folder = platformdirs.user_cache_path("mitsuba_diffraction", appauthor=False)
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None  # not "~", without a home


@dataclass(frozen=True)
class Record:
    """Content of a file.

    Attributes
    ----------
    document : plain data, as JSON has it.
    arrays : of any shape and type.
    """

    document: Any
    arrays: Sequence[NDArray[Any]]


def cached(
    kind: str,
    key: str,
    memory: MutableMapping[str, T],
    make: Callable[[], T],
    pack: Callable[[T], Record],
    unpack: Callable[[Record], T],
) -> T:
    """Return the value under a key, from memory or from disk; otherwise make and store it.

    Of several threads and processes that want one thing at a time, one makes it and the others
    wait. A cache that cannot be written fails no command: results are rebuilt.

    Parameters
    ----------
    kind : one word, of files for people.
    key : of all that it is made of, see `key_of`.
    memory : where this process keeps it.
    make : makes it.
    pack, unpack : from it to its record, and back; a ValueError is for what does not fit.
    """
    value = memory.get(key)
    if value is None:
        with _making.setdefault((kind, key), threading.Lock()):
            value = memory.get(key)
            if value is None:
                value = memory[key] = _from_disk(kind, key, make, pack, unpack)
    return value


def _from_disk(
    kind: str, key: str, make: Callable[[], T], pack: Callable[[T], Record],
    unpack: Callable[[Record], T],
) -> T:  # fmt: skip
    folder = cache_folder()
    if folder is None:
        return make()
    # files of an earlier layout are called by the first half of their keys
    path, title = folder / f"{kind}-{key[-32:]}{SUFFIX}", f"{_MAGIC} {kind} {key}"
    value = found(path, title, unpack)
    if value is None:
        with _locked(path):
            value = found(path, title, unpack)  # made by whoever was waited for
            if value is None:
                value = make()
                record = pack(value)
                with contextlib.suppress(DiffractionError, OSError):
                    write_record(path, title, record)
                    _prune(path.parent)
    return value


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the lock of a file among all processes; does nothing without file locks."""
    lock = FileLock(path.with_suffix(".lock"))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire(timeout=PATIENCE)
    except Timeout:
        warn(
            f"another process holds '{lock.lock_file}' and makes what this one needs: waiting for "
            "it; if none is at work, remove that file"
        )
        with contextlib.suppress(OSError):
            lock.acquire()
    except OSError:
        pass
    try:
        yield
    finally:
        if lock.is_locked:
            # whoever waits for it makes another; Windows removes the file on release
            with contextlib.suppress(OSError):
                os.unlink(lock.lock_file)
            lock.release()


def found(path: Path, title: str, unpack: Callable[[Record], T]) -> T | None:
    """Read the value in a file of this title; None if it is missing, or damaged.

    A damaged file is removed, with a warning: it is made again.

    unpack : from the record to the value; a ValueError is for what does not fit.
    """
    try:
        value = unpack(read_record(path, title))
        os.utime(path)  # recently used ones are kept longest
        return value
    except OSError:
        return None
    except (ValueError, LookupError, TypeError, MemoryError, RecursionError) as error:
        warn(f"'{path}' is damaged ({one_line(str(error))[:100]}) and made again")
        with contextlib.suppress(OSError):
            path.unlink()
        return None


def read_record(path: Path, title: str) -> Record:
    """Read what `write_record` wrote under this title, and check it.

    Raises
    ------
    OSError
        If the file does not exist.
    ValueError, LookupError, TypeError, MemoryError, RecursionError
        If it is damaged, or has another title.
    """
    if not path.is_file():
        raise FileNotFoundError
    arrays = []
    with open(path, "rb") as file:
        if file.read(_HEAD) != _head(title, file):
            raise ValueError("its checksum or its key is another's")
        file.seek(_HEAD)
        while file.peek(1):
            arrays.append(np.load(file))
    text, *rest = arrays
    return Record(json.loads(text.tobytes()), rest)


def write_record(path: Path, title: str, record: Record) -> None:
    """Write a record in one piece: a line with title and SHA-256, JSON, and the arrays.

    Raises a DiffractionError if it cannot be written.
    """
    text = np.frombuffer(json.dumps(record.document).encode(), np.uint8)
    with atomic_path(path) as temporary, open(temporary, "w+b") as file:
        file.write(bytes(_HEAD))
        for array in (text, *record.arrays):
            np.save(file, array)
        head = _head(title, file)
        file.seek(0)
        file.write(head)


def _head(title: str, file: BufferedReader | BufferedRandom) -> bytes:
    """Return the first line of a file, filled up to `_HEAD` bytes."""
    file.seek(_HEAD)
    digest = hashlib.file_digest(file, "sha256").hexdigest()
    return f"{title} {digest}".encode().ljust(_HEAD - 1) + b"\n"


def _prune(folder: Path) -> None:
    """Remove the files unused for longest until the folder is small enough."""
    remove_abandoned(folder, r"\w+-\w+", SUFFIX)
    newest = sorted(folder.glob(f"*{SUFFIX}"), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for n, path in enumerate(newest):
        total += path.stat().st_size
        if total > MAX_BYTES and n > 0:
            path.unlink(missing_ok=True)


def loaded_once(
    path: str | os.PathLike[str],
    load: Callable[[str | os.PathLike[str]], T],
    in_use: MutableMapping[str, T],
) -> T:
    """Return what `load` makes of a file, kept in `in_use` until the file changes."""
    try:
        status = os.stat(path)
    except OSError:
        return load(path)  # whose error names the damage
    note_input(path)
    key = f"{Path(path).resolve()} {status.st_mtime_ns} {status.st_size}"
    value = in_use.get(key)
    return in_use.setdefault(key, load(path)) if value is None else value
