"""Types of arguments: what does not fit is a usage error that quotes the value."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

from ..errors import DiffractionError, quoted
from ..scene.parameters import Change, change_of


def path_ending_in(*suffixes: str) -> Callable[[str], Path]:
    """A path whose suffix is one of those given."""

    def path(text: str) -> Path:
        result = Path(text)
        if result.suffix.lower() not in suffixes:
            expected = " or ".join(suffixes)
            raise argparse.ArgumentTypeError(
                f"expected a name ending in {expected}, got {quoted(text)}"
            )
        return result

    return path


def whole_number(least: int) -> Callable[[str], int]:
    """A whole number that is at least `least` and fits 31 bits."""

    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if not least <= value < 2**31:
            raise argparse.ArgumentTypeError(
                f"expected a whole number from {least}, got {quoted(text)}"
            )
        return value

    return number


def number_between(low: float, high: float) -> Callable[[str], float]:
    """A number from `low` to `high`; NaN is none."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"expected a number from {low:g} to {high:g}, got {quoted(text)}"
            )
        return value

    return number


def definition(text: str) -> tuple[str, str]:
    """KEY=VALUE."""
    key, equals, value = text.partition("=")
    if not (equals and key):
        raise argparse.ArgumentTypeError(f"expected KEY=VALUE, got {quoted(text)}")
    return key, value


def change(text: str) -> Change:
    """KEY=FROM:TO, a parameter of a scene that changes."""
    try:
        return change_of(text)
    except DiffractionError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
