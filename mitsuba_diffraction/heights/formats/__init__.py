"""Readers of height files, by kind; each returns `RawHeights`.

Contents
--------
images       PNG, BMP, TIFF and EXR
grids        grids of numbers: NPY, TXT, CSV
instruments  files of scanning-probe instruments (extra `afm`)
catalogue    what is read, from which instruments, and what to export else
headers      sizes of scans by the headers of instrument files, a witness beside the library
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["RawHeights", "catalogue"]


@dataclass
class RawHeights:
    """Heights in a file's own unit, before the user's lengths and treatments are applied."""

    # (ny, nx), y upwards (`values[0]` is y = 0), in `unit`, or in [0, 1] if `relative`; points
    # without data are NaN
    values: npt.NDArray[np.floating]
    pixel_size: tuple[float, float] | None = None  # (dx, dy) in µm if the file says so
    sized: bool = True  # the file states the unit of the pixel size; else µm are assumed
    relative: bool = False  # the values are fractions of a full scale that the file does not know
    notes: tuple[str, ...] = ()  # one line per choice that the reader made
    unit: float | None = 1.0  # µm in one unit of the values; None if the file says no length
    stated: str = ""  # name of that unit in the file; "" if the format implies µm
    unclear: str = ""  # place in the file that names another unit than µm, though not the heights'
