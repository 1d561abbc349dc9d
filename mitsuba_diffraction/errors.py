"""What goes wrong, in one line that says what to do."""

from __future__ import annotations

import re

# Characters of a word or quotation, and of a message, at most.
_WORD, _MESSAGE = 160, 500
# a quotation begins after white space, "(" or "=": what lies between two of them is none
_LONG = re.compile(rf"(?<![^\s(=])'[^'\n]{{{_WORD - 1},}}'|[^\s']{{{_WORD + 1},}}")


class DiffractionError(ValueError):
    """Bad input: the text is one line with what, where, the allowed values and the way out.

    Names of thousands of characters are shortened in it, see `shortened`.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(shortened(text))


class DiffractionWarning(UserWarning):
    """The result is usable, but outside the range where the model or the data can be trusted."""


def shortened(text: str) -> str:
    """The text with every long word, usually a path, and every long quotation cut in its middle.

    What is still over 500 characters loses its middle, too.
    """

    def cut(found: re.Match[str]) -> str:
        return _cut(found[0], _WORD)

    return _cut(_LONG.sub(cut, text), _MESSAGE)


def _cut(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    half = (most - 3) // 2
    return f"{text[:half]}...{text[-half:]}"


def one_line(text: str) -> str:
    """The text with every run of white space, line ends included, made one blank."""
    return " ".join(text.split())


def quoted(value: object) -> str:
    """A value as an error quotes it: in one line of at most 80 characters."""
    text = one_line(repr(value))
    return text if len(text) <= 80 else text[:77] + "..."
