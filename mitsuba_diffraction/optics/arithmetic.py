"""Arithmetic that a formula is written in: NumPy arrays, plain numbers, or any registered kind.

A formula takes the operators + − * / & | and comparisons from its numbers, and everything else from
the arithmetic of their kind:

    def decaying_root(square):
        xp = of(square)
        if not is_complex(square):
            return xp.sqrt(xp.maximum(square, 0.0))
        ...

Then the formula works for NumPy and plain numbers (here), for Dr.Jit (`plugin.arithmetic`) and for
symbols that print as a shader. Functions take real numbers, except `reciprocal`, `fma` and `where`.
Vectors are tuples of numbers. A branch on a value is `where`; a branch on a number's kind
(`is_complex`) is a branch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

import numpy as np

Number: TypeAlias = Any
"""A number of any kind: real or complex; an array, a lane's number, or a symbol."""

Mask: TypeAlias = Any
"""The result of a comparison of numbers."""


class Arithmetic(Protocol):
    """Functions of one kind of numbers."""

    sqrt: Callable[[Number], Number]
    exp: Callable[[Number], Number]
    exp2: Callable[[Number], Number]
    log2: Callable[[Number], Number]
    sin: Callable[[Number], Number]
    cos: Callable[[Number], Number]
    arcsin: Callable[[Number], Number]
    #: x to the power of y, x ≥ 0.
    power: Callable[[Number, Number], Number]
    floor: Callable[[Number], Number]
    absolute: Callable[[Number], Number]
    minimum: Callable[[Number, Number], Number]
    maximum: Callable[[Number, Number], Number]
    #: 1/x of a real or a complex number.
    reciprocal: Callable[[Number], Number]
    #: x clipped to [low, high].
    clip: Callable[[Number, Number, Number], Number]
    #: a b + c, rounded once where the kind can.
    fma: Callable[[Number, Number, Number], Number]
    #: Numbers of the first where a mask holds, else of the second.
    where: Callable[[Mask, Number, Number], Number]
    #: Complex number of its real and its imaginary part.
    complex: Callable[[Number, Number], Number]
    #: Whether a number is complex by its type.
    is_complex: Callable[[Number], bool]
    #: x clipped to [low, high]; NaN becomes low, so that its integer part is an index.
    bounded: Callable[[Number, Number, Number], Number]
    #: Integer part of x ≥ 0 as an index, a mask as index 0 or 1, and an index as a number.
    index: Callable[[Number], Number]
    flag: Callable[[Mask], Number]
    number: Callable[[Number], Number]
    arctan2: Callable[[Number, Number], Number]


class _Arrays:
    """Arithmetic of NumPy arrays, which all count as complex."""

    sqrt, exp, exp2, log2, sin, cos = np.sqrt, np.exp, np.exp2, np.log2, np.sin, np.cos
    floor, absolute, minimum, maximum = np.floor, np.abs, np.minimum, np.maximum
    arcsin, power, arctan2 = np.arcsin, np.power, np.arctan2
    where, clip, expm1 = np.where, np.clip, np.expm1

    @staticmethod
    def bounded(x: Number, low: Number, high: Number) -> Number:
        return np.where(x > low, np.minimum(x, high), low)

    @staticmethod
    def index(x: Number) -> Number:
        return np.asarray(x).astype(np.int64)

    flag = index

    @staticmethod
    def number(index: Number) -> Number:
        return np.asarray(index).astype(np.float64)

    @staticmethod
    def is_complex(x: Number) -> bool:
        return True  # roots of negative numbers are then well defined

    @staticmethod
    def reciprocal(x: Number) -> Number:
        return 1.0 / x

    @staticmethod
    def fma(a: Number, b: Number, c: Number) -> Number:
        return a * b + c

    @staticmethod
    def complex(real: Number, imag: Number) -> Number:
        return real + 1j * np.asarray(imag)


class _Plain:
    """Arithmetic of Python's numbers."""

    sqrt, exp, log2, sin, cos = math.sqrt, math.exp, math.log2, math.sin, math.cos
    floor, absolute, minimum, maximum = math.floor, abs, min, max
    arcsin, power = math.asin, pow
    reciprocal, fma, expm1 = _Arrays.reciprocal, _Arrays.fma, math.expm1
    complex, arctan2 = complex, math.atan2
    index, flag, number = int, int, float

    @staticmethod
    def bounded(x: float, low: float, high: float) -> float:
        return min(x, high) if x > low else low

    @staticmethod
    def exp2(x: float) -> float:
        return 2.0**x

    @staticmethod
    def clip(x: float, low: float, high: float) -> float:
        return min(max(x, low), high)

    @staticmethod
    def where(mask: bool, there: Number, elsewhere: Number) -> Number:
        return there if mask else elsewhere

    @staticmethod
    def is_complex(x: Number) -> bool:
        return isinstance(x, complex)


#: Kinds of numbers, tried in this order: a test of one number, and its arithmetic.
_KINDS: list[tuple[Callable[[Any], bool], Any]] = [
    (lambda x: isinstance(x, (np.ndarray, np.generic)), _Arrays),
]


def register(is_kind: Callable[[Any], bool], arithmetic: Any) -> None:
    """Add an `Arithmetic` of another kind of numbers.

    is_kind : whether a number is of this kind.
    """
    _KINDS.append((is_kind, arithmetic))


def of(*values: Number) -> Any:
    """Return the `Arithmetic` of values: of the first that is not a plain number, if any is not."""
    for value in values:
        if isinstance(value, (int, float, complex)) and not isinstance(value, np.generic):
            continue
        for is_kind, arithmetic in _KINDS:
            if is_kind(value):
                return arithmetic
        raise TypeError(f"no arithmetic of {type(value).__name__}")
    return _Plain


def is_complex(x: Number) -> bool:
    """Whether a number is complex by its type, whatever its value."""
    return bool(of(x).is_complex(x))


def squared(z: Number) -> Number:
    """Return |z|² of a real or a complex number."""
    return z.real * z.real + z.imag * z.imag if is_complex(z) else z * z


def modulus(z: Number) -> Number:
    """Return |z| of a real or a complex number."""
    xp = of(z)
    return xp.sqrt(squared(z)) if is_complex(z) else xp.absolute(z)


def one_minus_exp(x: Number) -> Number:
    """Return 1 − exp(−x), x ≥ 0, without cancellation.

    An arithmetic in double precision has `expm1`; without it, a series near 0 has an error of
    x⁵/120.
    """
    xp = of(x)
    if hasattr(xp, "expm1"):
        return -xp.expm1(-x)
    series = x * xp.fma(x, xp.fma(x, xp.fma(x, -1.0 / 24.0, 1.0 / 6.0), -0.5), 1.0)
    return xp.where(x < 0.05, series, 1.0 - xp.exp(-x))
