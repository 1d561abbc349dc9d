"""Arrays of heights in µm: NumPy's NPY files."""

from __future__ import annotations

import math
import tokenize
from pathlib import Path

import numpy as np

from ...errors import DiffractionError
from ..field import check_pixel_count
from .raw import RawHeights, first_line


def read_npy(path: Path) -> RawHeights:
    """Read heights in µm from an NPY file of shape (ny, nx), taken as it is: row 0 is y = 0.

    The header is checked before memory is reserved for what it claims, and pickled objects, which
    could run code, are refused.

    Raises
    ------
    DiffractionError
        If the file is no NPY, is truncated, or holds anything but a real two-dimensional array.
    """
    shown = repr(str(path))
    try:
        with path.open("rb") as stream:
            version = np.lib.format.read_magic(stream)
            read_header = {
                (1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0,
            }.get(version)
            if read_header is None:
                raise DiffractionError(
                    f"{shown} is NPY version {version[0]}.{version[1]}; save it again with np.save"
                )
            shape, fortran_order, dtype = read_header(stream)
            start = stream.tell()
            if dtype.kind not in "fiu":
                raise DiffractionError(
                    f"{shown} holds {dtype.name} values; expected real numbers in µm"
                )
            if len(shape) != 2 or min(shape) < 0:
                raise DiffractionError(
                    f"{shown} has shape {shape}; expected two dimensions (ny, nx)"
                )
            check_pixel_count(*shape, shown)
            size = math.prod(shape) * dtype.itemsize
            held = path.stat().st_size - start
            if held < size:
                raise DiffractionError(
                    f"{shown} is truncated: its header promises {size} bytes, {held} are there"
                )
            values = np.fromfile(stream, dtype=dtype, count=math.prod(shape))
    except DiffractionError:
        raise
    except (
        OSError, ValueError, EOFError, SyntaxError, TypeError, KeyError, OverflowError,
        MemoryError, RecursionError, tokenize.TokenError,
    ) as error:  # fmt: skip
        raise DiffractionError(
            f"{shown} is not a readable NPY file: {first_line(error)}"
        ) from error
    values = values.reshape(shape, order="F" if fortran_order else "C")
    # signalling NaNs, as damage makes them; what is no number is looked for later
    with np.errstate(invalid="ignore"):
        return RawHeights(values.astype(np.float64))
