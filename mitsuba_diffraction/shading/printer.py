"""Text of a function from the symbols of its results."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import DiffractionError
from .symbols import Scope, Symbol, argument_of, is_vector, symbol_kind

_WIDTH = 100
_JOINT = "\xa0"  # no line break

_PRECEDENCE = {
    "?": 1, "||": 2, "&&": 3, "==": 4, "!=": 4, "<": 5, "<=": 5, ">": 5, ">=": 5, "+": 6, "-": 6,
    "*": 7, "/": 7, "neg": 8, "!": 8,
}  # fmt: skip
_ATOM = 9
_LEAVES = ("name", "x", "y", "z", "real", "imag", "result")


@dataclass
class Function:
    """Function of a program.

    Attributes
    ----------
    name : in the program.
    text : its definition.
    kinds : of the results.
    record : builds the formula's return value from several results; None for a single result.
    """

    name: str
    text: str
    kinds: list[str]
    record: Callable[[list[Any]], tuple[Any, ...]] | None = None


class Printer:
    """Text of a function from the symbols of its results."""

    def __init__(self, scope: Scope) -> None:
        self._scope, self._dialect = scope, scope.dialect
        self._uses: dict[int, int] = {}
        self._variables: dict[int, str] = {}
        self._lines: list[str] = []

    def function(self, parameters: list[Symbol], result: Any, comment: str) -> Function:
        """Print a function; result : number, or tuple of numbers."""
        several = isinstance(result, tuple) and not is_vector(result)
        values = result if several else (result,)
        kinds = [symbol_kind(value) for value in values]
        leaves = [argument_of(value, self._scope) for value in values]
        for leaf in leaves:
            self._count(leaf)
        results = self._results(leaves, kinds, result) if several else []
        self._body(leaves, [name for _, name in results])
        kind = "void" if several else self._dialect.types[kinds[0]]
        text = self._written(self._scope.name, kind, parameters, results, comment)
        return Function(self._scope.name, text, kinds, record_of(result) if several else None)

    def staged(
        self,
        parameters: list[Symbol],
        result: Symbol,
        late: Sequence[str],
        names: Sequence[str],
        comment: str,
    ) -> tuple[Function, Function]:
        """Print two functions, see `programs.Program.add_staged`."""
        kept, order = {id(p) for p in parameters if p.parts[0] in late}, self._scope.order
        for symbol in order:
            if any(id(part) in kept for part in symbol.parts):
                kept.add(id(symbol))
        self._count(result)
        needed = [s for s in (*parameters, *order) if self._uses.get(id(s)) and s.kind != "call"]
        read = {
            id(part) for s in order if id(s) in kept and id(s) in self._uses for part in s.parts
        }
        ready = [s for s in needed if id(s) in read and id(s) not in kept]
        stored = [(s.kind, f"pair_{self._scope.take(_name_of(s, 'value'))}") for s in ready]
        first = Printer(self._scope)
        for symbol in ready:
            first._count(symbol)
        first._body(ready, [name for _, name in stored])
        early = [p for p in parameters if id(p) not in kept]
        by_kind: dict[str, list[str]] = {}
        for kind, name in stored:
            by_kind.setdefault(self._dialect.types[kind], []).append(name)
        values = "".join(f"{kind} {', '.join(words)};\n" for kind, words in by_kind.items())
        text = first._written(names[0], "void", early, [], f"Prepare `{names[1]}`.")
        second = Printer(self._scope)
        second._variables = {id(s): name for s, (_, name) in zip(ready, stored, strict=True)}
        second._count(result)
        second._body([result], [])
        last = [p for p in parameters if id(p) in kept]
        body = second._written(names[1], self._dialect.types[result.kind], last, [], comment)
        return Function(names[0], f"{values}\n{text}", []), Function(names[1], body, [result.kind])

    def _body(self, leaves: list[Any], names: list[str]) -> None:
        """Print the statements that assign results, or return the only one without a name."""
        outputs = {id(leaf): name for leaf, name in zip(leaves, names, strict=False)}
        for symbol in self._scope.order:
            self._statement(symbol, outputs)
        for leaf, name in zip(leaves, names, strict=False):
            if self._variables.get(id(leaf)) != name:
                self._line(f"{name} = {self.text(leaf)};")
        if not names:
            self._line(f"return {self.text(leaves[0])};")

    def _written(
        self,
        name: str,
        kind: str,
        parameters: list[Symbol],
        results: list[tuple[str, str]],
        comment: str,
    ) -> str:
        """Return the function with its head and comment."""
        types = self._dialect.types
        words = [f"{types[p.kind]} {p.parts[0]}" for p in parameters]
        words += [f"{self._dialect.result} {types[kind]} {name}" for kind, name in results]
        words = [word.replace(" ", _JOINT) for word in words]
        head = f"{kind} {name}({', '.join(words)})"
        lines = textwrap.wrap(comment, _WIDTH - 3, initial_indent="// ", subsequent_indent="// ")
        lines += textwrap.wrap(head, _WIDTH, subsequent_indent=" " * (head.index("(") + 1))
        return "\n".join([*lines, "{", *self._lines, "}", ""]).replace(_JOINT, " ")

    def _results(self, leaves: list[Any], kinds: list[str], result: Any) -> list[tuple[str, str]]:
        fields = getattr(result, "_fields", ())
        if len(fields) != len(leaves):
            fields = [_name_of(leaf, f"result{n}") for n, leaf in enumerate(leaves)]
        return [(k, self._scope.take(n)) for k, n in zip(kinds, fields, strict=True)]

    def _count(self, value: Any) -> None:
        """Count the uses of an expression and its parts."""
        uses = self._uses.get(id(value), 0)
        self._uses[id(value)] = uses + 1
        if id(value) in self._variables:
            return
        if not uses and hasattr(value, "operation") and value.operation != "name":
            for part in value.parts:
                self._count(part)

    def _statement(self, symbol: Symbol, outputs: Mapping[int, str]) -> None:
        """Print a variable, if the expression is one."""
        uses = self._uses.get(id(symbol), 0)
        if not uses or id(symbol) in self._variables:
            return
        if symbol.kind == "call":
            self._call(symbol, outputs)
        elif symbol.operation not in _LEAVES and (name := outputs.get(id(symbol))):
            self._line(f"{name} = {self.text(symbol)};")
            self._variables[id(symbol)] = name
        elif symbol.operation not in _LEAVES and (symbol.name or (uses > 1 and _long(symbol))):
            name = self._scope.take(symbol.name or symbol.hint or f"t{len(self._variables)}")
            self._line(f"{self._dialect.types[symbol.kind]} {name} = {self.text(symbol)};")
            self._variables[id(symbol)] = name

    def _call(self, call: Symbol, outputs: Mapping[int, str]) -> None:
        """Print a call of a function with several results."""
        names, declared = [], dict[str, list[str]]()
        results = [s for s in self._scope.order if s.operation == "result" and s.parts[0] is call]
        for symbol in results:
            name = outputs.get(id(symbol)) or self._scope.take(_name_of(symbol))
            if id(symbol) not in outputs:
                declared.setdefault(self._dialect.types[symbol.kind], []).append(name)
            self._variables[id(symbol)] = name
            names.append(name)
        for kind, variables in declared.items():
            self._line(f"{kind} {', '.join(variables)};")
        function, *arguments = call.parts
        self._line(f"{function}({', '.join([*map(self.text, arguments), *names])});")

    def _line(self, text: str) -> None:
        self._lines += textwrap.wrap(
            text, _WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 8,
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip

    def text(self, value: Any, precedence: int = 0) -> str:
        """Print an expression; precedence : of the operator around it."""
        if not isinstance(value, Symbol):
            return number(float(value))
        if id(value) in self._variables:
            return self._variables[id(value)]
        text, own = self._expression(value)
        return f"({text})" if own < precedence else text

    def _expression(self, symbol: Symbol) -> tuple[str, int]:
        """Return the text of an expression, and the precedence of its operator."""
        operation, parts = symbol.operation, symbol.parts
        if operation == "name":
            return parts[0], _ATOM
        if operation in self._dialect.components:
            return self.text(parts[0], _ATOM) + self._dialect.components[operation], _ATOM
        if symbol.kind == "complex" and operation != "call":
            return self._complex(operation, parts)
        if operation == "vector":
            name = self._dialect.types["vector"]
            return f"{name}({', '.join(map(self.text, parts))})", _ATOM
        if operation == "call":
            return f"{parts[0]}({', '.join(map(self.text, parts[1:]))})", _ATOM
        own = _PRECEDENCE.get(operation)
        if own is None:
            function = self._dialect.functions.get(operation, operation)
            return f"{function}({', '.join(map(self.text, parts))})", _ATOM
        if operation == "?":
            condition, one, other = (self.text(part, own + 1) for part in parts)
            return f"{condition} ? {one} : {other}", own
        if len(parts) == 1:
            return f"{'-' if operation == 'neg' else operation}{self.text(parts[0], own)}", own
        divisor = self._divisor(parts[1]) if operation == "*" else None
        if divisor is not None:
            operation, parts = "/", (parts[0], divisor)
        left, right = self.text(parts[0], own), self.text(parts[1], own + 1)
        return f"{left} {operation} {right}", own

    def _divisor(self, value: Any) -> Any:
        """Return x of 1/x, which a product divides by; None of other factors."""
        inverse = getattr(value, "operation", "") == "/" and id(value) not in self._variables
        return value.parts[1] if inverse and _one(value.parts[0]) else None

    def _complex(self, operation: str, parts: tuple[Any, ...]) -> tuple[str, int]:
        """Return the text of an operation of which an operand is complex."""
        words = self._dialect.complex
        of_complex = [getattr(part, "kind", "float") == "complex" for part in parts]

        def written(word: str, *operands: str) -> tuple[str, int]:
            template = words[word]
            infix = {"{} + {}": 6, "{} - {}": 6, "{} * {}": 7, "-{}": 8}.get(template, _ATOM)
            return template.format(*operands), infix

        if operation == "complex":
            return written("of", *map(self.text, parts))
        infix = {"+": 6, "-": 6, "*": 7, "/": 7, "neg": 8}[operation]
        texts = [self.text(part, infix + n) for n, part in enumerate(parts)]
        if operation == "*" and all(of_complex) and "(" in words["times"]:
            texts = [self.text(part) for part in parts]
        if operation == "neg":
            return written("negative", *texts)
        if operation == "/":
            if not of_complex[1]:
                return written("scaled", texts[0], self._ratio(parts[1]))
            inverse = written("inverse", self.text(parts[1]))[0]
            if _one(parts[0]):
                return inverse, _ATOM
            return written("times" if of_complex[0] else "scaled", *(
                (texts[0], inverse) if of_complex[0] else (inverse, texts[0])))  # fmt: skip
        if all(of_complex):
            return written({"+": "sum", "-": "difference", "*": "times"}[operation], *texts)
        if operation == "*":
            return written("scaled", *(texts if of_complex[0] else texts[::-1]))
        if operation == "+":
            return written("plus", *(texts if of_complex[0] else texts[::-1]))
        if of_complex[0]:
            return written("plus", texts[0], f"-{self.text(parts[1], 8)}")
        return written("plus", written("negative", texts[1])[0], texts[0])

    def _ratio(self, divisor: Any) -> str:
        return f"(1.0 / {self.text(divisor, 8)})"


def record_of(values: tuple[Any, ...]) -> Callable[[list[Any]], tuple[Any, ...]]:
    """Return a function that makes a tuple of the same type from a list."""
    make: Callable[[list[Any]], tuple[Any, ...]] = getattr(values, "_make", tuple)
    return make


def _name_of(value: Any, otherwise: str = "") -> str:
    """Return the name of a symbol: its variable's, its vector's, or its function's and a number."""
    if isinstance(value, Symbol) and value.operation in ("x", "y", "z"):
        return f"{value.parts[0].parts[0]}_{value.operation}"
    if not isinstance(value, Symbol) or value.operation != "result":
        return getattr(value, "name", None) or getattr(value, "hint", None) or otherwise
    call, number = value.parts
    return value.name or value.hint or f"{call.parts[0]}{number}"


def _one(value: Any) -> bool:
    return isinstance(value, int | float) and value == 1.0


def _long(symbol: Symbol) -> bool:
    """Whether an expression is more than a variable with a sign."""
    return symbol.operation != "neg" or getattr(symbol.parts[0], "operation", "name") not in _LEAVES


def number(value: float) -> str:
    """Write a number with the digits of single precision."""
    if not math.isfinite(value):
        raise DiffractionError(f"{value} is in a formula, which no shader can hold; give a bound")
    text = f"{value:.9g}"
    return text if any(c in text for c in ".e") else f"{text}.0"
