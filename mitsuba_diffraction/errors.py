"""Errors and warnings: one line with the mistake, its place and the remedy."""

from __future__ import annotations

import contextlib
import json
import re
import sys
import unicodedata
import warnings
from collections.abc import Iterable, Iterator, Sequence

# Packages whose lines mean nothing to whoever reads a warning.
_INTERNAL = ("mitsuba_diffraction", "mitsuba", "drjit")

# Characters of a word or quotation, and of a message, at most.
_WORD, _MESSAGE = 160, 500
# a quotation begins after white space, "(" or "="; text between two quotations is not quoted
_LONG = re.compile(rf"(?<![^\s(=])'[^'\n]{{{_WORD - 1},}}'|[^\s']{{{_WORD + 1},}}")


class DiffractionError(ValueError):
    """Bad input, in one line: what, where, the allowed values and what to do.

    Names of thousands of characters are shortened in it, see `shortened`.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(shortened(printable(text)))


class DiffractionWarning(UserWarning):
    """The result is usable, but outside the range in which the model or the data can be trusted."""


def warn(text: str) -> None:
    """Warn in the name of the first caller outside of the package, whose line is quoted.

    Python quotes the line that warns, or one a fixed number of calls above it; a plugin is called
    through Mitsuba, at any depth. Filters by module therefore see the module of the caller.
    """
    frame = sys._getframe(1)
    while frame.f_back is not None:
        package = str(frame.f_globals.get("__name__")).partition(".")[0]
        if package not in _INTERNAL:
            break
        frame = frame.f_back
    warnings.warn_explicit(
        one_line(text), DiffractionWarning, frame.f_code.co_filename, frame.f_lineno,
        module=frame.f_globals.get("__name__"),
        registry=frame.f_globals.setdefault("__warningregistry__", {}),
    )  # fmt: skip


def shortened(text: str) -> str:
    """Shorten every long word, usually a path, and every long quotation, by cutting out its middle.

    A text that still has over 500 characters loses its middle, too.
    """
    return _cut(_LONG.sub(lambda match: _cut(match[0], _WORD), text), _MESSAGE)


def _cut(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    half = (most - 3) // 2
    return f"{text[:half]}...{text[-half:]}"


def printable(text: str) -> str:
    r"""Escape characters that control a terminal: ESC, BEL, bidirectional overrides and the like.

    Line ends and tabs stay. Escapes are JSON's (\u001b), so that JSON keeps its meaning.
    """
    if text.isascii() and text.isprintable():
        return text

    def shown(character: str) -> str:
        harmless = character.isprintable() or character in "\n\t"
        blank = unicodedata.category(character) == "Zs"
        return character if harmless or blank else json.dumps(character)[1:-1]

    return "".join(map(shown, text))


def one_line(text: str) -> str:
    """Replace every run of white space by one blank, and escape what controls a terminal."""
    return printable(" ".join(text.split()))


def quoted(value: object) -> str:
    """Return a value as an error quotes it: in one line of at most 80 characters."""
    text = one_line(repr(value))
    return text if len(text) <= 80 else text[:77] + "..."


@contextlib.contextmanager
def unreadable(what: str) -> Iterator[None]:
    """Raise a DiffractionError for whatever a library raises inside on damaged data.

    what : the file, and that it cannot be read; the first line of the library's reason follows.
    """
    try:
        yield
    except (DiffractionError, MemoryError):
        raise
    except Exception as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        if isinstance(error, KeyError):  # whose text is the key alone
            lines = [f"it has no {quoted(*error.args[:1] or [''])}"]
        raise DiffractionError(f"{what}: {one_line(lines[0][:200])}") from error


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun, "1 scan" or "3 scans".

    noun : in the singular; plural : of a noun that takes no s.
    """
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def check_choice(name: str, value: object, choices: Iterable[str]) -> None:
    """Raise a DiffractionError if the value of a parameter is not one of `choices`."""
    if value not in (known := tuple(choices)):
        raise DiffractionError(
            f"{name}={quoted(value)} is unknown; choose one of {', '.join(known)}"
        )


def check_keys(where: str, keys: Iterable[str], known: Sequence[str]) -> None:
    """Raise a DiffractionError with the nearest known key if a file has an unknown key."""
    import difflib

    for key in keys:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f"did you mean {near[0]}? " if near else ""
            raise DiffractionError(
                f"{where}: unknown key {key!r}; {hint}Known are {', '.join(known)}"
            )
