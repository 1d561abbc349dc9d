"""Readers of height files, by kind; each returns `RawHeights`.

Contents
--------
images       PNG, BMP, TIFF and EXR
grids        grids of numbers: NPY, TXT, CSV
instruments  files of scanning-probe instruments (extra `afm`)
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...errors import DiffractionError


@dataclass
class RawHeights:
    """Heights in a file's own unit, before the user's lengths and treatments are applied."""

    # (ny, nx), y upwards (`values[0]` is y = 0), in `unit`, or in [0, 1] if `relative`; points
    # without data are NaN
    values: npt.NDArray[np.floating]
    pixel_size: tuple[float, float] | None = None  # (dx, dy) in µm if the file says so
    relative: bool = False  # the values are fractions of a full scale that the file does not know
    notes: tuple[str, ...] = ()  # one line per choice that the reader made
    unit: float | None = 1.0  # µm in one unit of the values; None if the file says no length
    stated: str = ""  # name of that unit in the file; "" if the format implies µm


def existing_file(path: str | os.PathLike[str]) -> Path:
    """Return the path of a file after checks that it exists, can be opened and is not empty.

    Raises
    ------
    DiffractionError
        If a check fails.
    """
    shown = repr(os.fspath(path))
    try:
        file = Path(path)
        if file.is_dir():
            raise DiffractionError(f"{shown} is a folder, not a height field; name a file in it")
        if file.exists() and not file.is_file():  # opening a pipe would wait for its writer
            raise DiffractionError(f"{shown} is a pipe or a device; write what it gives to a file")
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


def first_line(error: BaseException) -> str:
    """Return the first line of an exception's text, to quote a library in a one-line message."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
