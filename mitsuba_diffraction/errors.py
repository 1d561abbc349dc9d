"""What goes wrong, in one line that says what to do."""

from __future__ import annotations


class DiffractionError(ValueError):
    """Bad input: the text is one line with what, where, the allowed values and the way out."""


class DiffractionWarning(UserWarning):
    """The result is usable, but outside the range where the model or the data can be trusted."""


def one_line(text: str) -> str:
    """The text with every run of white space, line ends included, made one blank."""
    return " ".join(text.split())


def quoted(value: object) -> str:
    """A value as an error quotes it: in one line of at most 80 characters."""
    text = one_line(repr(value))
    return text if len(text) <= 80 else text[:77] + "..."
