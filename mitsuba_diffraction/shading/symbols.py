"""Symbols: numbers that record the expressions of a formula, to write it in another language.

A symbol has the operators of a number, and `arithmetic.of` gives its functions. What no shader can
express, a branch on values or an unknown function, raises a DiffractionError with the file and line
of the formula. `programs` runs formulas on symbols and writes them.
"""

from __future__ import annotations

import linecache
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn, TypeAlias

from ..errors import DiffractionError
from ..optics import arithmetic

#: Kinds of symbols: a real number, a complex number, a condition, and three real numbers.
KINDS = ("float", "complex", "bool", "vector")

#: Files whose frames are no formula's.
OWN_FILES = {__file__, arithmetic.__file__}


#: Function that is being written, see `programs`.
Scope: TypeAlias = Any

#: Functions that are being written, the current one last.
scopes: list[Scope] = []


def current() -> Scope:
    """Return the function that is being written."""
    return scopes[-1]


def _condition(operation: str) -> Callable[[Any, Any], Any]:
    """Return a method of `Symbol` whose result is a condition."""
    return lambda self, other: _node(operation, self, other, kind="bool")


class Symbol:
    """Expression of a formula.

    Attributes
    ----------
    kind : one of `KINDS`.
    operation, parts : operator or function, and its operands; "name" and its text for a variable.
    name, hint : of the variable that holds the value in the formula, and in a function that the
        formula runs.
    scope : function that the expression belongs to.
    """

    __slots__ = ("hint", "kind", "name", "operation", "parts", "scope")

    def __init__(
        self, kind: str, operation: str, parts: tuple[Any, ...], scope: Scope | None = None
    ) -> None:
        self.kind, self.operation, self.parts, self.scope = kind, operation, parts, scope
        self.name: str | None = None
        self.hint: str | None = None

    def __add__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else _node("+", self, other)

    def __radd__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else _node("+", other, self)

    def __sub__(self, other: Any) -> Any:
        return self if _is(other, 0.0) else _node("-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return -self if _is(other, 0.0) else _node("-", other, self)

    def __mul__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else _node("*", self, other)

    def __rmul__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else _node("*", other, self)

    def __truediv__(self, other: Any) -> Any:
        return self if _is(other, 1.0) else _node("/", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return _node("/", other, self)

    def __neg__(self) -> Any:
        return _node("neg", self)

    def __pow__(self, power: Any) -> Any:
        return self * self if _is(power, 2.0) else _node("pow", self, power)

    def __abs__(self) -> Any:
        return _node("abs", self)

    __lt__, __le__, __gt__, __ge__ = map(_condition, ("<", "<=", ">", ">="))
    __eq__, __ne__ = map(_condition, ("==", "!="))
    __and__, __or__ = map(_condition, ("&&", "||"))

    def __invert__(self) -> Any:
        return _node("!", self, kind="bool")

    __hash__ = object.__hash__

    @property
    def real(self) -> Any:
        """Real part."""
        return _part("real", self)

    @property
    def imag(self) -> Any:
        """Imaginary part, 0.0 of a real number."""
        return _part("imag", self)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Let a NumPy number on the left of an operator be a constant; refuse other functions."""
        if ufunc.__name__ not in _OPERATORS or method != "__call__":
            refuse(f"it calls numpy.{ufunc.__name__}, which no shader has; use arithmetic.of")
        return getattr(inputs[1], _OPERATORS[ufunc.__name__])(float(inputs[0]))

    def __bool__(self) -> NoReturn:
        refuse("it branches on a value; select by arithmetic.of(…).where")

    def __float__(self) -> NoReturn:
        refuse("it needs a value; a shader's numbers have none before it runs")

    def __complex__(self) -> NoReturn:
        self.__float__()

    __int__ = __index__ = __len__ = __iter__ = __float__

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):  # protocols that Python asks for
            raise AttributeError(name)
        refuse(f"numbers of a shader have no .{name}")

    def __repr__(self) -> str:
        return f"Symbol({self.name or self.operation})"


_OPERATORS = {
    "add": "__radd__", "subtract": "__rsub__", "multiply": "__rmul__", "divide": "__rtruediv__",
    "true_divide": "__rtruediv__",
}  # fmt: skip


def _is(value: Any, number: float) -> bool:
    return isinstance(value, int | float) and value == number


def refuse(reason: str) -> NoReturn:
    """Raise a DiffractionError with the line of the formula that runs."""
    frame: FrameType | None = sys._getframe()
    while frame is not None and frame.f_code.co_filename in OWN_FILES:
        frame = frame.f_back
    assert frame is not None  # a formula called
    file, line = frame.f_code.co_filename, frame.f_lineno
    text = linecache.getline(file, line).strip()
    raise DiffractionError(
        f"{Path(file).name}, line {line}, cannot be written as a shader: {reason}: {text!r}"
    )


def _node(operation: str, *parts: Any, kind: str | None = None) -> Any:
    """Return the expression in the function that is written, each once."""
    for part in parts:
        if not isinstance(part, Symbol | int | float):
            try:  # NumPy's numbers
                float(part)
            except (TypeError, ValueError):
                refuse(f"{part!r} is not a real number")
    if kind is None:
        kinds = {part.kind for part in parts if isinstance(part, Symbol)}
        kind = "complex" if "complex" in kinds else "float"
    return current().expression(kind, operation, parts)


def _part(which: str, value: Symbol) -> Any:
    if value.kind == "float":
        return value if which == "real" else 0.0
    if value.operation == "complex":
        return value.parts[which == "imag"]
    return current().expression("float", which, (value,))


class _UnknownFunctionError(DiffractionError, AttributeError):
    """Function that no shader has; formulas may ask by `hasattr`."""


class Symbols:
    """Arithmetic of symbols, see `arithmetic`."""

    @staticmethod
    def complex(real: Any, imag: Any) -> Any:
        """Return a complex number."""
        return _node("complex", real, imag, kind="complex")

    @staticmethod
    def exp(x: Any) -> Any:
        """Return exp(x), also of a complex number."""
        if arithmetic.is_complex(x):
            size = _node("exp", x.real)
            return Symbols.complex(size * _node("cos", x.imag), size * _node("sin", x.imag))
        return _node("exp", x)

    @staticmethod
    def where(condition: Any, one: Any, other: Any) -> Any:
        """Return one number where a condition holds, or else the other."""
        if arithmetic.is_complex(one) or arithmetic.is_complex(other):
            return Symbols.complex(*(Symbols.where(condition, a, b) for a, b in (
                (_real(one), _real(other)), (_imag(one), _imag(other)))))  # fmt: skip
        return _node("?", condition, one, other)

    @staticmethod
    def fma(a: Any, b: Any, c: Any) -> Any:
        """Return a b + c."""
        return a * b + c

    @staticmethod
    def reciprocal(x: Any) -> Any:
        """Return 1/x."""
        return _node("/", 1.0, x)

    @staticmethod
    def is_complex(x: Any) -> bool:
        """Return whether a number is complex."""
        return isinstance(x, complex) or (isinstance(x, Symbol) and x.kind == "complex")

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("__"):
            raise AttributeError(name)
        if name not in _FUNCTIONS:
            try:
                refuse(f"no shader has the function {name}")
            except DiffractionError as error:
                raise _UnknownFunctionError(str(error)) from None
        return lambda *values: _node(_FUNCTIONS[name], *values)


_FUNCTIONS = {
    "sqrt": "sqrt", "exp2": "exp2", "log2": "log2", "sin": "sin", "cos": "cos", "floor": "floor",
    "arcsin": "asin", "power": "pow", "absolute": "abs", "minimum": "min", "maximum": "max",
    "clip": "clamp",
}  # fmt: skip
arithmetic.register(lambda x: isinstance(x, Symbol), Symbols())


def _real(x: Any) -> Any:
    return x.real if isinstance(x, Symbol | complex) else x


def _imag(x: Any) -> Any:
    return x.imag if isinstance(x, Symbol | complex) else 0.0


def components_of(scope: Scope, vector: Symbol) -> tuple[Any, ...]:
    """Return the three components of a vector."""
    return tuple(scope.expression("float", axis, (vector,)) for axis in "xyz")


def is_vector(value: Any) -> bool:
    """Whether a value is three real numbers that are a direction or a colour."""
    if type(value) is not tuple or len(value) != 3:
        return False
    return all(isinstance(v, int | float) or getattr(v, "kind", "") == "float" for v in value)


def symbol_kind(value: Any) -> str:
    """Return the kind of an argument or a result of a function."""
    if isinstance(value, Symbol):
        return value.kind
    if is_vector(value):
        return "vector"
    if not isinstance(value, int | float):
        refuse(f"{value!r} is not a number")
    return "float"


def argument_of(value: Any, scope: Scope | None = None) -> Any:
    """Return three components as a vector, and other numbers as they are."""
    if not is_vector(value):
        return value
    scope = scope or current()
    first = value[0]
    if isinstance(first, Symbol) and first.operation == "x":
        vector = first.parts[0]
        if all(v is c for v, c in zip(value, components_of(scope, vector), strict=True)):
            return vector
    return scope.expression("vector", "vector", value)
