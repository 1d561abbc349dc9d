"""Programs: formulas of `optics`, written as functions of a shading language.

`Program.add` runs a formula on `symbols`, with all formulas that it calls, and writes one function.
The docstring's first paragraph becomes its comment. An expression that is used more than once is a
variable, with the name that the formula gives it.
"""

from __future__ import annotations

import inspect
import math
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..errors import DiffractionError
from .dialects import Dialect
from .symbols import Complex, Symbol, Trace

_WIDTH = 100
_JOINT = "\xa0"  # no line break
_COMPONENTS = {"vector": "xyz", "complex": ("real", "imag")}
_PRECEDENCE = {
    "?": 1, "||": 2, "&&": 3, "==": 4, "!=": 4, "<": 5, "<=": 5, ">": 5, ">=": 5, "+": 6, "-": 6,
    "*": 7, "/": 7, "neg": 8, "!": 8,
}  # fmt: skip
_ATOM = 9


@dataclass
class Program:
    """Functions in a dialect."""

    dialect: Dialect
    functions: dict[str, str] = field(default_factory=dict)

    def add(self, formula: Callable[..., Any], *arguments: Any, name: str = "") -> None:
        """Write a formula as a function.

        Raises a DiffractionError if the formula cannot be written, with its line.

        Parameters
        ----------
        formula : function of `optics`, or of a model in its arithmetic.
        arguments : of each parameter its kind ("float", "complex", "vector": three components), a
            tuple of kinds, or else a value that is constant in the program.
        name : of the function; the formula's by default.
        """
        name = name or formula.__name__
        parameters, results = self._run(formula, arguments)
        self.functions[name] = parameters.written(name, results, _comment(formula))

    def _run(self, formula: Callable[..., Any], arguments: Sequence[Any]) -> Any:
        """Run a formula on symbols; return its parameters, and its results by name."""
        parameters = _Parameters(self.dialect, Trace())
        names = inspect.signature(formula).parameters
        values = [parameters.add(*pair) for pair in zip(names, arguments, strict=False)]
        result = formula(*values)
        parameters.trace.end_line()
        if not isinstance(result, tuple) or _is_vector(result):
            return parameters, {"": result}
        fields = getattr(result, "_fields", ())
        if len(fields) != len(result):
            fields = [getattr(part, "name", None) or f"result{n}" for n, part in enumerate(result)]
        return parameters, dict(zip(map(parameters.take, fields), result, strict=True))

    @property
    def text(self) -> str:
        """Source of all functions."""
        return "\n".join(self.functions.values())


class _Parameters:
    """Parameters of a function that is written, and the text of its expressions."""

    def __init__(self, dialect: Dialect, trace: Trace) -> None:
        self.dialect, self.trace = dialect, trace
        self.kinds: dict[str, str] = {}
        self.known: dict[int, str] = {}
        self._taken: set[str] = set()

    def add(self, name: str, argument: Any) -> Any:
        """Return a formula's argument: symbols of a kind or of a tuple of kinds, or a constant."""
        if isinstance(argument, tuple):
            fields = getattr(argument, "_fields", [f"{name}{n}" for n in range(len(argument))])
            values = [self.add(*pair) for pair in zip(fields, argument, strict=True)]
            return argument._make(values) if hasattr(argument, "_make") else tuple(values)
        if not isinstance(argument, str):
            return argument
        word = self.take(name)
        self.kinds[word] = argument
        parts = [f"{word}{self.dialect.components[part]}" for part in _COMPONENTS.get(argument, ())]
        symbols = [Symbol("float", "name", (text,), self.trace) for text in parts or [word]]
        if argument == "complex":
            return Complex(*symbols)
        return tuple(symbols) if argument == "vector" else symbols[0]

    def take(self, name: str) -> str:
        """Return a name for a variable that is new in the function and legal in the language."""
        name = re.sub(r"\W", "", name.encode("ascii", "ignore").decode()).strip("_") or "value"
        if name.isupper() or name in self.dialect.reserved:  # macros of the shaders are upper-case
            name += "_"
        numbered, n = name, 1
        while numbered in self._taken:
            n += 1
            numbered = f"{name.rstrip('_')}_{n}"
        self._taken.add(numbered)
        return numbered

    def written(self, name: str, results: Mapping[str, Any], comment: str) -> str:
        """Write a function with its comment.

        results : by name; one without a name is returned.
        """
        types = self.dialect.types
        uses: dict[int, int] = {}
        read = [part for result in results.values() for part in _parts(result)]
        for part in [*read, *(part for symbol in _needed(read) for part in symbol.parts)]:
            uses[id(part)] = uses.get(id(part), 0) + 1
        lines: list[str] = []
        for symbol in self.trace.order:
            often = uses.get(id(symbol), 0)
            if often and (symbol.name or (often > 1 and not _signed_leaf(symbol))):
                word = self.take(symbol.name or f"t{len(self.known)}")
                lines += _wrapped(f"{types[symbol.kind]} {word} = {self.text(symbol)};")
                self.known[id(symbol)] = word
        for word, result in results.items():
            start = f"{word} =" if word else "return"
            lines += _wrapped(f"{start} {self.text(result)};")
        words = [f"{types[kind]} {word}" for word, kind in self.kinds.items()]
        kind = "void" if "" not in results else types[_kind(results[""])]
        outputs = [(w, r) for w, r in results.items() if w]
        words += [f"{self.dialect.result} {types[_kind(r)]} {w}" for w, r in outputs]
        joined = ", ".join(word.replace(" ", _JOINT) for word in words)
        head = textwrap.wrap(
            f"{kind} {name}({joined})", _WIDTH, subsequent_indent=" " * (len(kind) + len(name) + 2)
        )
        note = textwrap.wrap(comment, _WIDTH - 3, initial_indent="// ", subsequent_indent="// ")
        return "\n".join([*note, *head, "{", *lines, "}", ""]).replace(_JOINT, " ")

    def text(self, value: Any, precedence: int = 0) -> str:
        """Write an expression; precedence : of the operator around it."""
        if isinstance(value, tuple):
            return f"{self.dialect.types['vector']}({', '.join(map(self.text, value))})"
        if not isinstance(value, Symbol):
            return number(float(value))
        if id(value) in self.known:
            return self.known[id(value)]
        text, own = self._expression(value.operation, value.parts)
        return f"({text})" if own < precedence else text

    def _expression(self, operation: str, parts: tuple[Any, ...]) -> tuple[str, int]:
        """Return the text of an expression, and the precedence of its operator."""
        if operation == "name":
            return parts[0], _ATOM
        own = _PRECEDENCE.get(operation)
        if own is None:
            function = self.dialect.functions.get(operation, operation)
            return f"{function}({', '.join(map(self.text, parts))})", _ATOM
        if operation == "?":
            condition, one, other = (self.text(part, own + 1) for part in parts)
            return f"{condition} ? {one} : {other}", own
        if len(parts) == 1:
            return f"{'-' if operation == 'neg' else operation}{self.text(parts[0], own)}", own
        return f"{self.text(parts[0], own)} {operation} {self.text(parts[1], own + 1)}", own


def _needed(results: Iterable[Any]) -> list[Symbol]:
    """Return the expressions that results depend on, and these, each once."""
    found: dict[int, Symbol] = {}
    waiting = list(results)
    while waiting:
        symbol = waiting.pop()
        if isinstance(symbol, Symbol) and id(symbol) not in found:
            found[id(symbol)] = symbol
            waiting += symbol.parts
    return list(found.values())


def _signed_leaf(symbol: Symbol) -> bool:
    """Whether an expression is a variable with a sign."""
    return symbol.operation == "neg" and getattr(symbol.parts[0], "operation", "name") == "name"


def _parts(result: Any) -> Sequence[Any]:
    """Return the numbers of a result."""
    return result if isinstance(result, tuple) else (result,)


def _kind(result: Any) -> str:
    """Return the kind of a result."""
    return "vector" if isinstance(result, tuple) else getattr(result, "kind", "float")


def _is_vector(value: tuple[Any, ...]) -> bool:
    """Whether a value is three real numbers that are a direction or a colour."""
    return type(value) is tuple and len(value) == 3


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(
        text, _WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 8,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def _comment(formula: Callable[..., Any]) -> str:
    """Return the first paragraph of a docstring, in one line."""
    return " ".join((inspect.getdoc(formula) or "").partition("\n\n")[0].split())


def number(value: float) -> str:
    """Write a number with the digits of single precision."""
    if not math.isfinite(value):
        raise DiffractionError(f"{value} is in a formula, which no shader can hold; give a bound")
    text = f"{value:.9g}"
    return text if any(c in text for c in ".e") else f"{text}.0"
