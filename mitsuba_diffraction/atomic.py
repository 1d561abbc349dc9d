"""Writing files so that a crash, a full disk or Ctrl-C never leaves half of one."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .errors import DiffractionError


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside `path`; rename it there on success, remove it otherwise.

    The temporary name keeps the suffix of `path`, since image writers choose a format by it.

    Raises
    ------
    DiffractionError
        If the folder is missing or cannot be written, if `path` is a folder, or the disk is full.
    """
    target = Path(path)
    if target.is_dir():
        raise DiffractionError(f"cannot write '{target}': it is a folder; name a file in it")
    try:
        handle, name = tempfile.mkstemp(
            dir=target.parent, prefix=f".{target.stem}.", suffix=target.suffix
        )
    except OSError as error:
        raise DiffractionError(
            f"cannot write '{target}': {error.strerror}; choose a folder that exists and can be "
            "written to"
        ) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes private files; a finished result follows the user's umask like any other
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        os.replace(temporary, target)
    except OSError as error:
        raise DiffractionError(
            f"cannot write '{target}': {error.strerror or error}; nothing was left behind"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
