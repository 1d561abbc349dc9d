"""Spellings of an earlier version: each still works, with one line that says the current one."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Sequence

from .console import say

#: Options whose values are a range FIRST:LAST, and were two numbers or "FIRST,LAST".
_RANGES = ("--wavelength-range", "--angles")
_COMMA = re.compile(r"([-+\d.eE]+),([-+\d.eE]+)$")
# The page of `export-viewer` was an argument.
_OUTPUT = ("-o", "--output")
# Commands that put surfaces on the ids of a scene.
_SCENES = ("render", "plan", "view", "compare", "export-viewer")
#: Names of options by their earlier names, with the commands that they are renamed in.
NAMES = {
    "--look": ("--finish", ("render",)),
    "--view": ("--tonemap", ("render", "tonemap", *_SCENES)),
    "--windows": ("--positions", ("evaluate",)),
    "--turn": ("--rotate", ("tangents",)),
    "--material": ("--assign", _SCENES),
}


def current(argv: Sequence[str]) -> list[str]:
    """Return a command line in current spellings; print a line for each that is replaced."""
    words: list[str] = []
    rest = list(argv)
    command = next((word for word in rest if not word.startswith("-")), "")
    while rest:
        word = rest.pop(0)
        name, equals, value = word.partition("=")
        if name in _RANGES:
            words += _range(name, value if equals else None, rest)
        elif name in NAMES and command in NAMES[name][1]:
            words.append(f"{NAMES[name][0]}{equals}{value}")
            say(f"{name} is now {NAMES[name][0]}")
        elif command == "export-viewer" and word.endswith(".html") and words[-1] not in _OUTPUT:
            words += ["-o", word]
            say(f"'{word}' is now '-o {word}'")
        else:
            words.append(word)
    return words


def _range(name: str, value: str | None, rest: list[str]) -> list[str]:
    """Return the words of a range; takes its values from the words that follow."""
    given = value is not None
    if value is None:
        if not rest:
            return [name]  # the parser says what is missing
        value = rest.pop(0)
    old = f"{name} {value}"
    if pair := _COMMA.match(value):
        value = f"{pair[1]}:{pair[2]}"
    elif not given and _is_number(value) and rest and _is_number(rest[0]):
        last = rest.pop(0)
        old, value = f"{old} {last}", f"{value}:{last}"
    if old != f"{name} {value}":
        say(f"'{old}' is now '{name} {value}'")
    return [f"{name}={value}"]  # one word: the value may begin with a minus


def _is_number(text: str) -> bool:
    with contextlib.suppress(ValueError):
        float(text)
        return True
    return False
