"""Dr.Jit's arithmetic for the formulas of `optics` (see `optics.arithmetic`)."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ..optics import arithmetic
from .types import Float, Number


class _Kernel:
    """Arithmetic of the numbers of the current variant."""

    sqrt, exp, exp2, log2, sin, cos = dr.sqrt, dr.exp, dr.exp2, dr.log2, dr.sin, dr.cos
    floor, absolute, minimum, maximum = dr.floor, dr.abs, dr.minimum, dr.maximum
    reciprocal, clip, fma, where = dr.rcp, dr.clip, dr.fma, dr.select
    arcsin, power = dr.asin, dr.power
    is_complex = dr.is_complex_v

    @staticmethod
    def complex(real: Float, imag: Float) -> Number:
        return mi.Complex2f(real, imag)


def register() -> None:
    """Let formulas take Dr.Jit's numbers; called once, when the package is imported."""
    arithmetic.register(_is_kernels, _Kernel)


def _is_kernels(x: Any) -> bool:
    return bool(dr.is_array_v(x))
