"""Files written whole: a crash, a full disk or Ctrl-C never leaves half of one."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import re
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path

from .errors import DiffractionError
from .inputs import note_output, refuse_input
from .system import process_lives

# A temporary file is .STEM.HOST-PID-RANDOM.SUFFIX, so that a later run can tell whether the process
# that made it still lives. The stem is cut: the whole name may have 255 bytes.
_HOST = hashlib.sha256(platform.node().encode()).hexdigest()[:6]
_STEM = 60
_in_use: set[Path] = set()


def make_folder(folder: Path) -> None:
    """Make a folder, and the folders above it, unless it exists.

    Raises a DiffractionError if it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DiffractionError(
            f"cannot make the folder '{folder}': {error.strerror}; choose another"
        ) from error


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it there on success, remove it otherwise.

    The temporary name keeps the suffix of `path`, since image writers choose a format by it. What a
    killed process left of the same file is removed.

    The content is on the disk before the file is renamed. Of writers that lose errors when they
    close a file, Mitsuba's pictures are encoded to memory, and other files are read back.

    Raises a DiffractionError as `check_target` does, if the folder is missing or cannot be written,
    or the disk is full.
    """
    target = Path(path)
    check_target(target)
    remove_abandoned(target.parent, re.escape(target.stem[:_STEM]), target.suffix)
    try:
        temporary = _created(target)
    except OSError as error:
        raise DiffractionError(
            f"cannot write '{target}': {error.strerror}; choose a folder that exists and can be "
            "written to"
        ) from error
    _in_use.add(temporary)
    try:
        yield temporary
        # a network's or a full disk may refuse the content late
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        try:
            os.replace(temporary, target)
        except PermissionError as error:  # on Windows no open file can be replaced
            raise DiffractionError(
                f"cannot write '{target}': {error.strerror}; close the programs that have it open"
            ) from error
        note_output(target)
    except OSError as error:
        raise DiffractionError(
            f"cannot write '{target}': {error.strerror or error}; no file was left behind"
        ) from error
    finally:
        with contextlib.suppress(PermissionError):  # on Windows, a file that a writer left open
            temporary.unlink(missing_ok=True)
        _in_use.discard(temporary)


def _created(target: Path) -> Path:
    """Create a temporary file for a target, with the permissions of any new file."""
    while True:
        name = f".{target.stem[:_STEM]}.{_HOST}-{os.getpid()}-{secrets.token_hex(4)}{target.suffix}"
        path = target.with_name(name)
        with contextlib.suppress(FileExistsError):
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            return path


def check_target(target: Path) -> None:
    """Refuse an output in whose place no file may be put.

    Raises a DiffractionError if it is a folder, a pipe or a device, or a file that the running
    command reads.
    """
    try:
        mode = target.stat().st_mode
    except (OSError, ValueError):  # missing, or no name of a file: reported by who creates it
        return
    if stat.S_ISDIR(mode):
        raise DiffractionError(f"cannot write '{target}': it is a folder; name a file in it")
    if not stat.S_ISREG(mode):
        raise DiffractionError(f"cannot write '{target}': it is a pipe or a device; name a file")
    refuse_input(target)


def remove_temporaries() -> None:
    """Remove the temporary files of this process, which is about to end without unwinding."""
    for temporary in tuple(_in_use):
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def remove_abandoned(folder: Path, stem: str, suffix: str) -> None:
    """Remove temporary files whose process was killed, of targets called `stem` (a pattern)."""
    name = re.compile(rf"\.{stem}\.{_HOST}-(\d+)-\w+{re.escape(suffix)}")
    with contextlib.suppress(OSError):  # a folder that cannot be read is reported by the writer
        for entry in folder.iterdir():
            match = name.fullmatch(entry.name)
            if match and not process_lives(int(match[1])):
                entry.unlink(missing_ok=True)
