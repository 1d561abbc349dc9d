"""Programs: formulas of `optics`, written as functions of a shading language.

`Program.add` runs a formula on `symbols`. The formula becomes a function of the program, and so
does each function with the decorator `arithmetic.formula` that it calls. Local variables keep their
names, the docstring's first paragraph becomes the function's comment, and an expression that is
used more than once is a variable. The language (`dialects`) decides how numbers, complex numbers
and calls are written.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from ..errors import DiffractionError
from ..optics import arithmetic
from .dialects import Dialect
from .printer import Function, Printer, record_of
from .symbols import (
    OWN_FILES,
    Symbol,
    argument_of,
    components_of,
    current,
    refuse,
    scopes,
    symbol_kind,
)

OWN_FILES.add(__file__)


@dataclass
class Program:
    """Functions in a dialect, those that a function calls before it.

    declared : names that the rest of the shader declares: uniforms, functions, macros.
    complex_numbers : whether a function has complex numbers; their operations then come first.
    """

    dialect: Dialect
    declared: frozenset[str] = frozenset()
    functions: dict[tuple[Any, ...], Function] = field(default_factory=dict)
    complex_numbers: bool = False
    _owners: dict[str, Callable[..., Any]] = field(default_factory=dict)

    def add(self, formula: Callable[..., Any], *arguments: Any, name: str = "") -> Function:
        """Write a formula, and the formulas that it calls, as functions.

        Raises a DiffractionError if the formula cannot be written, with its line, or if the shader
        declares the name.

        Parameters
        ----------
        formula : function of `optics`, or of a model in its arithmetic.
        arguments : of each parameter its kind ("float", "complex", "vector": three components), a
            tuple of kinds, or else a value that is constant in the program.
        name : of the function; the formula's by default.
        """
        name = name or formula.__name__.lstrip("_")
        self._check_name(formula, name)
        return self.function_of(formula, arguments, name)

    def function_of(
        self, formula: Callable[..., Any], arguments: tuple[Any, ...], name: str = ""
    ) -> Function:
        """Return the function of a formula for kinds of arguments, written at its first use."""
        formula = getattr(formula, "__wrapped__", formula)
        key = (formula, name, *map(_key, arguments))
        if key not in self.functions:
            scope = Scope(
                self, formula, name or self._free_name(formula, formula.__name__.lstrip("_"))
            )
            parameters, result = scope.run(arguments)
            self.functions[key] = Printer(scope).function(parameters, result, _comment(formula))
        return self.functions[key]

    def _check_name(self, formula: Callable[..., Any], name: str) -> None:
        """Refuse a name that is not this formula's alone."""
        if self._free_name(formula, name) != name:
            raise DiffractionError(f"the shader already declares the name {name}; choose another")

    def _free_name(self, formula: Callable[..., Any], name: str) -> str:
        """Return a name that neither the rest of the shader nor another formula has."""
        formula = getattr(formula, "__wrapped__", formula)
        taken = self.declared | self.dialect.reserved
        while name in taken or self._owners.setdefault(name, formula) is not formula:
            name += "_"
        return name

    def add_staged(
        self,
        formula: Callable[..., Any],
        *arguments: Any,
        late: Sequence[str],
        names: Sequence[str],
    ) -> None:
        """Write a formula as two functions: one prepares all that some parameters do not change.

        The prepared values are global variables, for languages that have them.

        Parameters
        ----------
        formula, arguments : as for `add`; the result is one number.
        late : parameters of the second function; the others belong to the first.
        names : of both functions.
        """
        for name in names:
            self._check_name(formula, name)
        scope = Scope(self, formula, names[1])
        parameters, result = scope.run(arguments)
        first, second = Printer(scope).staged(parameters, result, late, names, _comment(formula))
        for function in (first, second):
            self.functions[(formula, function.name)] = function

    @property
    def text(self) -> str:
        """Source of all functions."""
        texts = dict.fromkeys(function.text for function in self.functions.values())
        prelude = [self.dialect.prelude] if self.complex_numbers else []
        return "\n".join([*prelude, *texts])


class Scope:
    """Function that is being written: its expressions, each once, in the order of the formula."""

    def __init__(self, program: Program, formula: Callable[..., Any], name: str) -> None:
        self.program, self.formula, self.name = program, formula, name
        self.dialect = program.dialect
        self.expressions: dict[tuple[Any, ...], Symbol] = {}
        self.order: list[Symbol] = []
        self.callees: set[str] = set()
        self.taken: set[str] = set()

    def expression(self, kind: str, operation: str, parts: tuple[Any, ...]) -> Symbol:
        """Return the symbol of an expression, which may be known already."""
        key = (kind, operation, *(id(p) if isinstance(p, Symbol) else p for p in parts))
        if key not in self.expressions:
            self.program.complex_numbers |= kind == "complex"
            self._check(parts)
            self.expressions[key] = symbol = Symbol(kind, operation, parts, self)
            self.order.append(symbol)
        return self.expressions[key]

    def _check(self, parts: Iterable[Any]) -> None:
        for part in parts:
            if isinstance(part, Symbol) and part.scope is not self:
                refuse("it reads a variable of another function; hand it on as an argument")

    def called(self, formula: Callable[..., Any], values: Sequence[Any]) -> Any:
        """Return the results of a call of another formula, which is written if it is new."""
        function = self.program.function_of(formula, tuple(map(symbol_kind, values)))
        self.callees.add(function.name)
        parts, kinds = (function.name, *map(argument_of, values)), function.kinds
        if function.record is None:
            return _components(self.expression(kinds[0], "call", parts))
        call = self.expression("call", "call", parts)
        results = [self.expression(kind, "result", (call, n)) for n, kind in enumerate(kinds)]
        return function.record(list(map(_components, results)))

    def run(self, arguments: Sequence[Any]) -> tuple[list[Symbol], Any]:
        """Run the formula on symbols; return its parameters' symbols, and its result."""
        parameters: list[Symbol] = []
        names = list(inspect.signature(self.formula).parameters)
        values = [
            _parameter(self, name, argument, parameters)
            for name, argument in zip(names, arguments, strict=False)
        ]
        with _active(self), _local_names(self):
            return parameters, self.formula(*values)

    def take(self, name: str) -> str:
        """Return a name for a variable that is new in the function and legal in the language."""
        name = re.sub(r"\W", "", name.encode("ascii", "ignore").decode()).strip("_") or "value"
        macro = name.isupper() and name in self.program.declared
        if macro or name in self.dialect.reserved or name in {self.name, *self.callees}:
            name += "_"
        numbered, n = name, 1
        while numbered in self.taken:
            n += 1
            numbered = f"{name.rstrip('_')}_{n}"
        self.taken.add(numbered)
        return numbered


def _parameter(scope: Scope, name: str, argument: Any, parameters: list[Symbol]) -> Any:
    """Return a formula's argument, and add its leaves to the function's parameters."""
    if isinstance(argument, str):
        symbol = Symbol(argument, "name", (scope.take(name),), scope)
        scope.program.complex_numbers |= argument == "complex"
        parameters.append(symbol)
        return symbol if argument != "vector" else components_of(scope, symbol)
    if isinstance(argument, tuple):
        fields = getattr(argument, "_fields", range(len(argument)))
        parts = [
            _parameter(scope, _word(name, argument, field), part, parameters)
            for field, part in zip(fields, argument, strict=True)
        ]
        return record_of(argument)(parts)
    return argument


def _components(result: Symbol) -> Any:
    """Return a number, or the components of a vector."""
    return components_of(current(), result) if result.kind == "vector" else result


def _key(argument: Any) -> Any:
    if isinstance(argument, tuple):
        return (type(argument), *map(_key, argument))
    return argument if isinstance(argument, str) else id(argument)


def _comment(formula: Callable[..., Any]) -> str:
    """Return the first paragraph of a docstring, in one line."""
    return " ".join((inspect.getdoc(formula) or "").partition("\n\n")[0].split())


@contextmanager
def _active(scope: Scope) -> Iterator[None]:
    """Let a function be the one that expressions belong to."""
    before = arithmetic.emission
    scopes.append(scope)
    arithmetic.emission = _emitted
    try:
        yield
    finally:
        scopes.pop()
        arithmetic.emission = before


def _emitted(formula: Callable[..., Any], values: tuple[Any, ...]) -> Any:
    """Call a formula from within another: write a call if a symbol is among its arguments."""
    parts = [part for value in values for part in (value if isinstance(value, tuple) else [value])]
    if not any(isinstance(part, Symbol) for part in parts):
        return formula(*values)
    return current().called(formula, values)


@contextmanager
def _local_names(scope: Scope) -> Iterator[None]:
    """Name expressions like the local variables of the formula and of functions that it runs."""

    def on_return(frame: FrameType, event: str, _: Any) -> None:
        if event != "return" or scopes[-1:] != [scope]:
            return
        own, file = frame.f_code is scope.formula.__code__, frame.f_code.co_filename
        if own or file == scope.formula.__code__.co_filename or file in formula_files:
            for name, value in frame.f_locals.items():
                _name(scope, name, value, own)

    folder = Path(__file__).parent
    formula_files = {str(file) for file in folder.glob("*.py")} - OWN_FILES
    before = sys.getprofile()
    sys.setprofile(on_return)
    try:
        yield
    finally:
        sys.setprofile(before)


def _name(scope: Scope, name: str, value: Any, own: bool) -> None:
    """Name a symbol, or the parts of a tuple; own : a variable of the formula itself."""
    if isinstance(value, Symbol):
        if value.scope is scope and own:
            value.name = name
        elif value.scope is scope and value.hint is None:
            value.hint = name
    elif isinstance(value, tuple):
        fields = getattr(value, "_fields", range(len(value)))
        for suffix, part in zip(fields, value, strict=True):
            word = _word(name, value, suffix)
            if not (isinstance(part, Symbol) and part.name):
                _name(scope, word, part, own)


def _word(name: str, record: tuple[Any, ...], field: str | int) -> str:
    """Return the name of a tuple's part; `cos_i` of `geometry`, a record called after its class."""
    if isinstance(field, int):
        return f"{name}{field}"
    return field if name == type(record).__name__.lower() else f"{name}_{field}"
