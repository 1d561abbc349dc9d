"""Dr.Jit's arithmetic for the formulas of `optics` (see `optics.arithmetic`)."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from ..optics import arithmetic
from .memory import index_between
from .types import Float, Index, Mask, Number


def maximum(x: Float, least: Float) -> Float:
    """Return the larger of single numbers; NaN where x is NaN.

    One or two instructions of LLVM, for five of `dr.maximum`, and the same derivative. Spectra
    would become plain arrays.
    """
    return dr.select(x <= least, least, x)


def minimum(x: Float, most: Float) -> Float:
    """Return the smaller number (see `maximum`)."""
    return dr.select(x > most, most, x)


def clip(x: Float, least: Float, most: Float) -> Float:
    """Return x between bounds; NaN where x is NaN."""
    return minimum(maximum(x, least), most)


def index_of(x: Float) -> Index:
    """Return the integer part of a number from 0 to 2³¹.

    One instruction of LLVM, which converts to signed numbers only.
    """
    return mi.UInt32(mi.Int32(x))


def float_of(index: Index) -> Float:
    """Return an index below 2³¹ as a number, by one instruction, like `index_of`."""
    return mi.Float(mi.Int32(index))


def plain(number: Float) -> float:
    """Return the number that all lanes share, without derivatives."""
    return float(dr.slice(dr.detach(number)))


class _Kernel:
    """Arithmetic of the numbers of the current variant."""

    sqrt, exp, exp2, log2, sin, cos = dr.sqrt, dr.exp, dr.exp2, dr.log2, dr.sin, dr.cos
    floor, absolute, reciprocal, fma, where = dr.floor, dr.abs, dr.rcp, dr.fma, dr.select
    minimum, maximum, clip = staticmethod(minimum), staticmethod(maximum), staticmethod(clip)
    arcsin, power, arctan2 = dr.asin, dr.power, dr.atan2
    is_complex = dr.is_complex_v
    bounded = staticmethod(index_between)
    index, number = staticmethod(index_of), staticmethod(float_of)

    @staticmethod
    def flag(mask: Mask) -> Index:
        return dr.select(mask, mi.UInt32(1), mi.UInt32(0))

    @staticmethod
    def complex(real: Float, imag: Float) -> Number:
        return mi.Complex2f(real, imag)


def register() -> None:
    """Let formulas take Dr.Jit's numbers; called once, when the package is imported."""
    arithmetic.register(_is_kernels, _Kernel)


def _is_kernels(x: Any) -> bool:
    return bool(dr.is_array_v(x))
