"""Symbols: real numbers that record the expressions of a formula, to write it in another language.

A symbol has the operators of a number, and `arithmetic.of` gives its functions. A complex number is
a pair of symbols, so expressions are real or conditions. What no shader can express, a branch on
values or an unknown function, raises a DiffractionError with the file and line of the formula.
`programs` runs formulas on symbols and writes them.
"""

from __future__ import annotations

import linecache
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

from ..errors import DiffractionError
from ..optics import arithmetic

_OWN_FILES = {__file__, arithmetic.__file__}
_ASSIGNED = re.compile(r"\s*([A-Za-z]\w*) = ")


def _frame_of_formula() -> FrameType:
    """Return the frame of the formula that runs."""
    frame: FrameType | None = sys._getframe()
    while frame is not None and frame.f_code.co_filename in _OWN_FILES:
        frame = frame.f_back
    assert frame is not None  # a formula called
    return frame


def refuse(reason: str) -> NoReturn:
    """Raise a DiffractionError with the line of the formula that runs."""
    frame = _frame_of_formula()
    file, line = frame.f_code.co_filename, frame.f_lineno
    text = linecache.getline(file, line).strip()
    raise DiffractionError(
        f"{Path(file).name}, line {line}, cannot be written as a shader: {reason}: {text!r}"
    )


class Trace:
    """Expressions of one function, each once, in the order in which the formula makes them."""

    def __init__(self) -> None:
        self.order: list[Symbol] = []
        self._known: dict[tuple[Any, ...], Symbol] = {}
        self._line: tuple[str, int] | None = None
        self.pair: Complex | None = None  # last complex number

    def expression(self, kind: str, operation: str, parts: tuple[Any, ...]) -> Symbol:
        """Return the symbol of an expression, which may be known already."""
        key = (kind, operation, *(id(p) if isinstance(p, Symbol) else p for p in parts))
        if key not in self._known:
            frame = _frame_of_formula()
            line = frame.f_code.co_filename, frame.f_lineno
            if line != self._line:
                self.end_line()
                self._line = line
            self._known[key] = symbol = Symbol(kind, operation, parts, self)
            self.order.append(symbol)
        return self._known[key]

    def end_line(self) -> None:
        """Name the last number of a line like the variable that the line assigns."""
        if self._line is None or not (match := _ASSIGNED.match(linecache.getline(*self._line))):
            return
        last, name = self.order[-1], match[1]
        if self.pair is None or self.pair.imag is not last:
            last.name = name
        elif isinstance(self.pair.real, Symbol):
            self.pair.real.name, last.name = f"{name}_re", f"{name}_im"


def _operator(
    operation: str, neutral: float | None = None, *, swapped: bool = False, kind: str = "float"
) -> Callable[[Any, Any], Any]:
    """Return a method of `Symbol` for an operator, which leaves its neutral number out.

    swapped : whether the symbol is on the right.
    kind : of the result.
    """

    def method(self: Symbol, other: Any) -> Any:
        if isinstance(other, Complex):
            return NotImplemented
        if neutral is not None and _is(other, neutral):
            return self
        operands = (other, self) if swapped else (self, other)
        return _node(operation, *operands, kind=kind)

    return method


class Symbol:
    """Expression of a formula.

    Attributes
    ----------
    kind : "float" or "bool".
    operation, parts : operator or function, and its operands; "name" and its text for a variable.
    trace : function that the expression belongs to.
    name : variable that holds the value in the formula, or None.
    """

    __slots__ = ("kind", "name", "operation", "parts", "trace")

    def __init__(self, kind: str, operation: str, parts: tuple[Any, ...], trace: Trace) -> None:
        self.kind, self.operation, self.parts, self.trace = kind, operation, parts, trace
        self.name: str | None = None

    __add__, __radd__ = _operator("+", 0.0), _operator("+", 0.0, swapped=True)
    __mul__, __rmul__ = _operator("*", 1.0), _operator("*", 1.0, swapped=True)
    __sub__, __truediv__ = _operator("-", 0.0), _operator("/", 1.0)
    __rtruediv__ = _operator("/", swapped=True)

    def __rsub__(self, other: Any) -> Any:
        return -self if _is(other, 0.0) else _node("-", other, self)

    def __neg__(self) -> Any:
        return _node("neg", self)

    def __pow__(self, power: Any) -> Any:
        return self * self if _is(power, 2.0) else _node("pow", self, power)

    def __abs__(self) -> Any:
        return _node("abs", self)

    __lt__, __le__, __gt__, __ge__, __eq__, __ne__, __and__, __or__ = (
        _operator(operation, kind="bool")
        for operation in ("<", "<=", ">", ">=", "==", "!=", "&&", "||")
    )

    def __invert__(self) -> Any:
        return _node("!", self, kind="bool")

    __hash__ = object.__hash__

    @property
    def real(self) -> Any:
        """The number itself."""
        return self

    @property
    def imag(self) -> float:
        """0."""
        return 0.0

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Let a NumPy number on the left of an operator be a constant; refuse other functions."""
        if ufunc.__name__ not in _OPERATORS or method != "__call__":
            refuse(f"it calls numpy.{ufunc.__name__}, which no shader has; use arithmetic.of")
        return getattr(inputs[1], _OPERATORS[ufunc.__name__])(float(inputs[0]))

    def __bool__(self) -> NoReturn:
        refuse("it branches on a value; select by arithmetic.of(…).where")

    def __float__(self) -> NoReturn:
        refuse("it needs a value; a shader's numbers have none before it runs")

    __complex__ = __int__ = __index__ = __len__ = __iter__ = __float__

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):  # protocols that Python asks for
            raise AttributeError(name)
        refuse(f"numbers of a shader have no .{name}")


_OPERATORS = {
    "add": "__radd__", "subtract": "__rsub__", "multiply": "__rmul__", "divide": "__rtruediv__",
    "true_divide": "__rtruediv__",
}  # fmt: skip


class Complex:
    """Complex number of two real ones, at least one of which is a symbol."""

    __slots__ = ("imag", "real")

    def __init__(self, real: Any, imag: Any) -> None:
        self.real, self.imag = real, imag
        if isinstance(imag, Symbol):
            imag.trace.pair = self

    def __add__(self, other: Any) -> Complex:
        return Complex(self.real + other.real, self.imag + other.imag)

    def __sub__(self, other: Any) -> Complex:
        return Complex(self.real - other.real, self.imag - other.imag)

    def __rsub__(self, other: Any) -> Complex:
        return -self + other

    def __mul__(self, other: Any) -> Complex:
        if not isinstance(other, Complex):
            return Complex(self.real * other, self.imag * other)
        return Complex(
            self.real * other.real - self.imag * other.imag,
            self.real * other.imag + self.imag * other.real,
        )

    def __truediv__(self, other: Any) -> Complex:
        return self * Symbols.reciprocal(other)

    def __rtruediv__(self, other: Any) -> Complex:
        return Symbols.reciprocal(self) * other

    def __neg__(self) -> Complex:
        return Complex(-self.real, -self.imag)

    __radd__, __rmul__ = __add__, __mul__


def _is(value: Any, number: float) -> bool:
    return isinstance(value, int | float) and value == number


def _node(operation: str, *parts: Any, kind: str = "float") -> Any:
    """Return the expression in the function that is written, each once."""
    for part in parts:
        if not isinstance(part, Symbol | int | float):
            try:  # NumPy's numbers
                float(part)
            except (TypeError, ValueError):
                refuse(f"{part!r} is not a real number")
    trace = next(part.trace for part in parts if isinstance(part, Symbol))
    return trace.expression(kind, operation, parts)


class _UnknownFunctionError(DiffractionError, AttributeError):
    """Function that no shader has; formulas may ask by `hasattr`."""


class Symbols:
    """Arithmetic of symbols, see `arithmetic`."""

    complex = Complex

    @staticmethod
    def exp(x: Any) -> Any:
        """Return exp(x), also of a complex number."""
        if isinstance(x, Complex):
            size = Symbols.exp(x.real)
            return Complex(size * _function("cos", x.imag), size * _function("sin", x.imag))
        return _function("exp", x)

    @staticmethod
    def where(condition: Any, one: Any, other: Any) -> Any:
        """Return one number where a condition holds, or else the other."""
        if isinstance(one, Complex) or isinstance(other, Complex):
            return Complex(
                _node("?", condition, one.real, other.real),
                _node("?", condition, one.imag, other.imag),
            )
        return _node("?", condition, one, other)

    @staticmethod
    def fma(a: Any, b: Any, c: Any) -> Any:
        """Return a b + c."""
        return a * b + c

    @staticmethod
    def reciprocal(x: Any) -> Any:
        """Return 1/x."""
        if isinstance(x, Complex):
            square = x.real * x.real + x.imag * x.imag
            return Complex(x.real / square, -x.imag / square)
        return 1.0 / x

    @staticmethod
    def is_complex(x: Any) -> bool:
        """Return whether a number is complex."""
        return isinstance(x, complex | Complex)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("__"):
            raise AttributeError(name)
        if name not in _FUNCTIONS:
            try:
                refuse(f"no shader has the function {name}")
            except DiffractionError as error:
                raise _UnknownFunctionError(str(error)) from None
        return lambda *values: _function(name, *values)


def _function(name: str, *values: Any) -> Any:
    """Return the value of a function of `arithmetic`, a constant where all arguments are."""
    if any(isinstance(value, Symbol) for value in values):
        return _node(_FUNCTIONS[name], *values)
    return getattr(arithmetic.of(*values), name)(*values)


_FUNCTIONS = {
    "sqrt": "sqrt", "exp2": "exp2", "log2": "log2", "sin": "sin", "cos": "cos", "floor": "floor",
    "arcsin": "asin", "power": "pow", "absolute": "abs", "minimum": "min", "maximum": "max",
    "clip": "clamp", "exp": "exp",
}  # fmt: skip
arithmetic.register(lambda x: isinstance(x, Symbol | Complex), Symbols())
