"""Names of types of NumPy arrays, by their numbers: in double or single precision, and integers."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Real: TypeAlias = NDArray[np.float64]
Single: TypeAlias = NDArray[np.float32]
Complex: TypeAlias = NDArray[np.complex128]
Whole: TypeAlias = NDArray[np.int64]
