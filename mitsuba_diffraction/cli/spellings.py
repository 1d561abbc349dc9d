"""Spellings of an earlier version: each still works, with one line that says the current one."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence

from .console import say

#: Options whose values are a range FIRST:LAST, and were two numbers or "FIRST,LAST".
_RANGES = ("--wavelength-range", "--angles")
_COMMA = re.compile(r"([-+\d.eE]+),([-+\d.eE]+)$")


def current(argv: Sequence[str]) -> list[str]:
    """Return a command line in current spellings; print a line for each that is replaced."""
    words: list[str] = []
    rest = list(argv)
    while rest:
        word = rest.pop(0)
        name, equals, value = word.partition("=")
        if name not in _RANGES:
            words.append(word)
            continue
        if not equals and rest:
            value = rest.pop(0)
        old = f"{name} {value}"
        if pair := _COMMA.match(value):
            value = f"{pair[1]}:{pair[2]}"
        elif _is_number(value) and rest and _is_number(rest[0]):
            last = rest.pop(0)
            old, value = f"{old} {last}", f"{value}:{last}"
        elif not equals and not value:
            words.append(name)  # the parser says what is missing
            continue
        # one word: the value may begin with a minus
        words.append(f"{name}={value}")
        if old != f"{name} {value}":
            say(f"'{old}' is now '{name} {value}'")
    return words


def _is_number(text: str) -> bool:
    with contextlib.suppress(ValueError):
        float(text)
        return True
    return False
