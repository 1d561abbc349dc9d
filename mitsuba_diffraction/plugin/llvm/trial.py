"""Whether Dr.Jit survives an LLVM: known by its version, or tried in a child process."""

from __future__ import annotations

import functools
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

from ...errors import DiffractionError
from .find import TRUSTED, VARIABLE, Library

#: Older ones cannot compile Dr.Jit's kernels (tried: 14, 15 and 16).
OLDEST = 17


def usable(path: str | os.PathLike[str]) -> bool:
    """Whether Dr.Jit can work with the LLVM at `path`.

    Version 19 is trusted and older ones than 17 are not. What else there is has to compile and run
    a few kernels in a child process, once per file and version of Dr.Jit.
    """
    return fault_of(Library.at(path)) is None


def fault_of(library: Library) -> str | None:
    """Why Dr.Jit cannot work with it, as a clause, or None."""
    if not library.path.is_file():
        return "there is no such file"
    version = library.version
    if version == TRUSTED:
        return None
    works = False
    if version is None or version >= OLDEST:
        version, works = tried(library.path)
    if version is None:
        return "Dr.Jit cannot load it"
    if version < OLDEST:
        return f"LLVM {version} cannot compile the kernels of Dr.Jit"
    return None if works else f"LLVM {version} has not survived a trial kernel of Dr.Jit"


@functools.lru_cache
def tried(path: Path | None) -> tuple[int | None, bool]:
    """Version that Dr.Jit loads from `path`, None if it loads none, and whether that survives.

    A `path` of None stands for what Dr.Jit chooses by itself.
    """
    key = _key(path) if path else None
    if key and (known := _recall(key)):
        return known
    version, survived, lasting = _try(path)
    if key and lasting:
        _remember(key, version, survived)
    return version, survived


def _try(path: Path | None) -> tuple[int | None, bool, bool]:
    """(version or None, survived, whether that would come out the same another time)."""
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    environment["PYTHONPATH"] = os.pathsep.join(folder for folder in sys.path if folder)
    if path:
        environment[VARIABLE] = str(path)
    with tempfile.TemporaryDirectory() as empty:
        environment["DRJIT_CACHE_DIR"] = empty  # a kernel compiled earlier would prove nothing
        try:
            child = subprocess.run(
                [sys.executable, "-P", str(Path(__file__).with_name("kernels.py"))],
                env=environment,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=120,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return None, False, False
    said = child.stdout.split()
    if len(said) < 3:  # Dr.Jit itself could not be imported
        return None, False, False
    version = int(said[0])
    return (version if version > 0 else None), said[3:] == ["usable"], True


# ------------------------------------------------------------------ outcomes, kept on disk


def _key(path: Path) -> str:
    drjit = importlib.metadata.version("drjit")
    return f"{path} {path.stat().st_mtime_ns} drjit {drjit} {platform.machine()}"


def _file() -> Path:
    # not at the top: it loads NumPy and SciPy, and version 19 needs neither
    from ...tables.store.cache import cache_folder

    return cache_folder() / "llvm.json"


def _outcomes() -> dict[str, list[int | bool | None]]:
    """All that are kept; an unreadable file holds nothing, and the next trial replaces it."""
    try:
        outcomes = json.loads(_file().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return outcomes if isinstance(outcomes, dict) else {}


def _recall(key: str) -> tuple[int | None, bool] | None:
    match _outcomes().get(key):
        case [int() | None as version, bool(survived)]:
            return version, survived
    return None


def _remember(key: str, version: int | None, survived: bool) -> None:
    """Keep an outcome; where nothing can be written, the trial is simply run every time."""
    from ...atomic import atomic_path

    outcomes = _outcomes() | {key: [version, survived]}
    try:
        _file().parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(_file()) as path:
            path.write_text(json.dumps(outcomes, indent=1), encoding="utf-8")
    except (DiffractionError, OSError):
        return
