"""Arrays of heights in µm: NumPy's NPY files."""

from __future__ import annotations

import tokenize
from pathlib import Path

import numpy as np

from ...errors import DiffractionError
from ..field import check_pixel_count
from .raw import RawHeights, first_line

_BLOCK = 1 << 22  # values


def read_npy(path: Path) -> RawHeights:
    """Read heights in µm from an NPY file of shape (ny, nx), taken as it is: row 0 is y = 0.

    The file is mapped, so that a header that claims more than is there takes no memory; pickled
    objects, which could run code, are refused.

    Raises
    ------
    DiffractionError
        If the file is no NPY, is truncated, or holds anything but a real two-dimensional array.
    """
    shown = repr(str(path))
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
        if not isinstance(values, np.ndarray):
            raise DiffractionError(f"{shown} is an archive of arrays (NPZ); save one with np.save")
        if values.dtype.kind not in "fiu":
            raise DiffractionError(
                f"{shown} holds {values.dtype.name} values; expected real numbers in µm"
            )
        if values.ndim != 2:
            raise DiffractionError(
                f"{shown} has shape {values.shape}; expected two dimensions (ny, nx)"
            )
        check_pixel_count(values.shape[0], values.shape[1], shown)
        return RawHeights(_copied(path, values))
    except DiffractionError:
        raise
    except (
        OSError, ValueError, EOFError, SyntaxError, TypeError, KeyError, OverflowError,
        MemoryError, RecursionError, tokenize.TokenError,
    ) as error:  # fmt: skip
        raise DiffractionError(
            f"{shown} is not a readable NPY file: {first_line(error)}"
        ) from error


def _copied(path: Path, values: np.ndarray) -> np.ndarray:
    """The values, read-only; mapped anew for some rows at a time, which lets go of those before."""
    result = np.empty(values.shape, np.float64)
    rows = max(1, _BLOCK // values.shape[1])
    # signalling NaNs, as damage makes them; what is no number is looked for later
    with np.errstate(invalid="ignore"):
        for start in range(0, len(result), rows):
            mapped = np.load(path, mmap_mode="r", allow_pickle=False)
            result[start : start + rows] = mapped[start : start + rows]
    result.setflags(write=False)
    return result
