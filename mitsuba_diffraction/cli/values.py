"""Types of values on the command line: functions of a text, which refuse others with a quote."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, quoted

#: Numbers of an option that accepts ranges, at most.
_MOST_NUMBERS = 10_000


def value(expected: str, parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a type of argument.

    expected : the expected value, in words.
    parse : function of the text that returns its value. None, and a ValueError, are for others; a
        DiffractionError says itself what does not fit.
    """

    def parsed(text: str) -> Any:
        try:
            result = parse(text)
        except DiffractionError as error:
            raise argparse.ArgumentTypeError(str(error)) from error
        except ValueError:
            result = None
        if result is None:
            raise argparse.ArgumentTypeError(f"expected {expected}, got {quoted(text)}")
        return result

    return parsed


def path_ending_in(*suffixes: str) -> Callable[[str], Path]:
    """Return a type of argument: a path with one of the suffixes."""
    return value(
        f"a name ending in {' or '.join(suffixes)}",
        lambda text: path if (path := Path(text)).suffix.lower() in suffixes else None,
    )


def whole_number(least: int, most: int = 2**31 - 1) -> Callable[[str], int]:
    """Return a type of argument: a whole number of at least `least` that fits 31 bits."""
    end = f" to {most}" if most < 2**31 - 1 else ""
    return value(
        f"a whole number from {least}{end}",
        lambda text: n if least <= (n := int(text)) <= most else None,
    )


def number_between(low: float, high: float) -> Callable[[str], float]:
    """Return a type of argument: a number from `low` to `high`, and not NaN."""
    return value(
        f"a number from {low:g} to {high:g}",
        lambda text: x if low <= (x := float(text)) <= high else None,
    )


def pair(names: str, *, empty: bool = False) -> Callable[[str], tuple[str, str]]:
    """Return a type of argument: two texts around an equals sign, such as `names`.

    empty : whether the second may be empty.
    """

    def parse(text: str) -> tuple[str, str] | None:
        first, equals, second = text.partition("=")
        return (first, second) if first and equals and (second or empty) else None

    return value(names, parse)


def _range_of(text: str) -> list[float]:
    """Return a number, or numbers from FIRST to LAST by STEP; else raise a ValueError."""
    if ":" not in text:
        return [float(text)]
    first, last, step = (float(part) for part in text.split(":"))
    if not (step > 0.0 and last >= first and (last - first) / step < _MOST_NUMBERS):
        raise ValueError(text)
    return [first + n * step for n in range(int((last - first) / step + 1e-9) + 1)]


def _limits(text: str) -> tuple[float, float]:
    first, last = (float(part) for part in text.split(":"))
    return first, last


#: Type of argument: values and FIRST:LAST:STEP, joined by commas.
numbers = value(
    "numbers such as 30, 0,30,60 or -85:85:5 (FIRST:LAST:STEP, rising, at most "
    f"{_MOST_NUMBERS} of them)",
    lambda text: tuple(n for part in text.split(",") for n in _range_of(part)),
)
#: Type of argument: FIRST:LAST, two numbers; see `settings` for what they may be.
limits = value("FIRST:LAST, such as 400:700", _limits)
#: Type of an exposure.
STOPS = number_between(-100, 100)
#: Kinds of numbers whose limits the commands check.
NUMBERS: dict[Any, Callable[[str], Any]] = {
    float: value("one number", float), int: value("one whole number", int),
}  # fmt: skip
