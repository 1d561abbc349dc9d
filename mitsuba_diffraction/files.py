"""Input files, looked at before they are opened: every reader of the package goes through here.

Opening a pipe waits for somebody to write into it, and a device has no end. A name that is not
UTF-8 cannot be handed to Mitsuba or OpenEXR.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from .errors import DiffractionError

#: Largest text that is read at once, bytes: recipes, plans and reports are far smaller.
LARGEST_TEXT = 1_000_000


def readable_file(path: str | os.PathLike[str]) -> Path:
    """Return the path of a regular file that can be read and has content.

    Raises
    ------
    DiffractionError
        If the file is missing, a folder, a pipe or a device, unreadable or empty, or if its name
        is not UTF-8.
    """
    shown = repr(os.fspath(path))
    check_name(path)
    try:
        file = Path(path)
        refuse_pipe(file)
        if file.is_dir():
            raise DiffractionError(f"{shown} is a folder; name a file in it")
        with file.open("rb") as stream:
            first = stream.read(1)
    except DiffractionError:
        raise
    except FileNotFoundError as error:
        raise DiffractionError(f"{shown} does not exist; check the path") from error
    except OSError as error:
        raise DiffractionError(f"cannot read {shown}: {error.strerror}") from error
    except ValueError as error:  # a null character in the name
        raise DiffractionError(f"cannot read {shown}: {error}") from error
    if not first:
        raise DiffractionError(f"{shown} is empty (0 bytes)")
    return file


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return the content of a file.

    Raises
    ------
    DiffractionError
        As `readable_file`.
    """
    file = readable_file(path)
    try:
        return file.read_bytes()
    except OSError as error:
        raise DiffractionError(f"cannot read {str(file)!r}: {error.strerror}") from error


def read_text(path: str | os.PathLike[str], largest: int = LARGEST_TEXT) -> str:
    """Return the content of a text file in UTF-8 of at most `largest` bytes.

    Raises
    ------
    DiffractionError
        As `readable_file`, or if the file is larger, or not text.
    """
    file = readable_file(path)
    size = file.stat().st_size
    if size > largest:
        raise DiffractionError(
            f"{str(file)!r} is too large: {size} bytes, and a text may have {largest}; is it "
            "the right file?"
        )
    try:
        return read_bytes(file).decode("utf-8")
    except UnicodeDecodeError as error:
        raise DiffractionError(f"{str(file)!r} is not text (UTF-8)") from error


def refuse_pipe(path: Path) -> None:
    """Raise a DiffractionError for what exists and is neither a regular file nor a folder."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # missing, or no name of a file: reported by who opens it
        return
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise DiffractionError(
            f"{str(path)!r} is a pipe or a device; write its content to a file, and name that"
        )


def check_name(name: str | os.PathLike[str]) -> None:
    """Raise a DiffractionError for a name that is not UTF-8."""
    try:
        os.fspath(name).encode("utf-8")
    except UnicodeEncodeError as error:
        raise DiffractionError(f"{os.fspath(name)!r} is not UTF-8; rename the file") from error
