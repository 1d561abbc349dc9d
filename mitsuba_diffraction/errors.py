"""What goes wrong, in one line that says what to do."""

from __future__ import annotations


class DiffractionError(ValueError):
    """Bad input: the text is one line with what, where, the allowed values and the way out."""


class DiffractionWarning(UserWarning):
    """The result is usable, but outside the range where the model or the data can be trusted."""
