"""Where results go: checked before hours of work, not after."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

from ..errors import DiffractionError


def check_writable(path: Path, *, make_folder: bool = False) -> None:
    """Refuse an output that could not be written, leaving nothing behind.

    Parameters
    ----------
    path : the file to come.
    make_folder : a missing folder will be made, so the nearest existing one has to be writable.

    Raises
    ------
    DiffractionError
        If the folder is missing or cannot be written, or `path` is a folder.
    """
    if path.is_dir():
        raise DiffractionError(f"cannot write '{path}': it is a folder; name a file in it")
    folder = path.parent
    while make_folder and not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        # the permission bits do not tell: file systems may be read-only, or full of inodes
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise DiffractionError(
            f"cannot write '{path}': {error.strerror}; choose a folder that exists and is writable"
        ) from error


def check_outputs(
    outputs: Iterable[Path], sources: Iterable[Path], what: str, *, make_folder: bool = False
) -> None:
    """The same for all files of a command, none of which may be one that it reads.

    what : is written, in a word.

    Raises
    ------
    DiffractionError
        As in `check_writable`, or if a source would be overwritten.
    """
    read = [source for source in sources if source.exists()]
    for path in outputs:
        for source in read:
            if path.exists() and path.samefile(source):
                raise DiffractionError(
                    f"the {what} would overwrite its own source '{source}'; name another with -o"
                )
        check_writable(path, make_folder=make_folder)
