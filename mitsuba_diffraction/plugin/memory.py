"""Arrays in the memory of the current variant, and indices into them."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


def upload(kind: Any, values: NDArray[np.generic]) -> Any:
    """A Dr.Jit array in memory of Dr.Jit's own, which starts at a cache line.

    On the CPU an array made from NumPy's may go on using NumPy's memory: aligned by chance, and
    mistaken for other arrays when a function recorded by `dr.freeze` runs again. Scalar variants
    have no such arrays: there it stays NumPy's.
    """
    if not dr.is_jit_v(mi.Float):
        return values.ravel()
    array = kind(values.ravel()) * dr.opaque(kind, 1)
    dr.eval(array)
    return array


def read(kind: Any, source: Any, index: Any) -> Any:
    """One number of what `upload` made."""
    if not dr.is_jit_v(mi.Float):
        return kind(source[index])
    return dr.gather(kind, source, index)


def index_between(value: Any, low: float, high: float) -> Any:
    """The value clipped to an index's range; NaN, as from a degenerate mesh, becomes `low`.

    `dr.clip` would keep the NaN, and what an integer makes of it reads far outside the table.
    """
    return dr.fmin(dr.fmax(value, low), high)
