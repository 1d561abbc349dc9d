"""Files that the running command reads: no output replaces an input.

`files.readable_file`, through which every reader of the package goes, notes its file here; scenes
note the files that Mitsuba reads. `atomic.atomic_path`, through which every file is written, asks.
Only commands note: programs that call the library may replace files that they have read.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from .errors import DiffractionError


class _Noted:
    """Real paths of files and folders; of files that are read with the names that users gave."""

    def __init__(self) -> None:
        self.read: dict[str, str] = {}
        self.written: set[str] = set()
        self.folders: set[str] = set()


_noted: _Noted | None = None


@contextlib.contextmanager
def noted() -> Iterator[None]:
    """Note the files that are read inside, and let no output replace one."""
    global _noted
    before, _noted = _noted, _Noted()
    try:
        yield
    finally:
        _noted = before


def note_input(path: str | os.PathLike[str]) -> None:
    """Note that the command reads a file, unless the command itself has written it."""
    if _noted is not None and os.path.isfile(path):
        place = os.path.realpath(path)
        if place not in _noted.written:
            _noted.read.setdefault(place, os.fspath(path))


def note_folder(path: str | os.PathLike[str]) -> None:
    """Note that the command reads every file of a folder."""
    if _noted is not None:
        _noted.folders.add(os.path.realpath(path))


def note_output(path: str | os.PathLike[str]) -> None:
    """Note that the command has written a file, which it may read and write again."""
    if _noted is not None:
        _noted.written.add(os.path.realpath(path))


def input_at(path: str | os.PathLike[str]) -> str | None:
    """Return the name of the noted file that lies at a path, also under another name; or None."""
    if _noted is None or not os.path.exists(path):
        return None
    for place, name in _noted.read.items():
        with contextlib.suppress(OSError):  # of a file that is gone
            if os.path.samefile(path, place):  # also a hard link
                return name
    return None


def refuse_input(output: str | os.PathLike[str]) -> None:
    """Raise a DiffractionError if an output would replace a file that the command reads."""
    if (source := input_at(output)) is not None:
        raise DiffractionError(
            f"'{output}' would overwrite '{source}', which this command reads; choose another name "
            "for the output"
        )


def refuse_in_folder(output: str | os.PathLike[str]) -> None:
    """Raise a DiffractionError if an output lies in a folder of which all files are read.

    The next run would read it as well.
    """
    folder = os.path.dirname(os.path.realpath(output))
    if _noted is not None and folder in _noted.folders:
        raise DiffractionError(
            f"'{output}' lies in a folder of which this command reads every file, so that the next "
            "run would read it; choose another folder for the output"
        )
