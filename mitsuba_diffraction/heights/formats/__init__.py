"""Readers of height files, by kind, and what they take out of a file: `RawHeights`.

Contents
--------
images       PNG, BMP, TIFF and EXR
grids        grids of numbers: NPY, TXT, CSV
instruments  their files (extra `afm`)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass
class RawHeights:
    """Heights as one file holds them, before lengths and treatments are settled."""

    # (ny, nx), y upwards (`values[0]` is y = 0), in `unit`, or in [0, 1] if `relative`; points
    # without data are NaN
    values: npt.NDArray[np.floating]
    pixel_size: tuple[float, float] | None = None  # (dx, dy) in µm if the file says so
    relative: bool = False  # the values are fractions of a full scale that the file does not know
    notes: tuple[str, ...] = ()  # one line per choice that the reader made
    unit: float | None = 1.0  # µm in one unit of the values; None if the file says no length
    # that unit as the file states it; "" if the values are in µm because files of this kind are
    stated: str = ""


def first_line(error: BaseException) -> str:
    """The first line of an exception's text, for quoting a library inside a one-line message."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
