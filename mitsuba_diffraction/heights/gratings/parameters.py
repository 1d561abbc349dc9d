"""Checks of the numbers that generators of patches take, at the door."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from typing import Any

from ...errors import DiffractionError, quoted

Lengths = float | Sequence[float]
Counts = int | Sequence[int]


def number_between(value: float, where: str, least: float, most: float, unit: str = "") -> float:
    """`value` as a float between `least` and `most`, ends included, or one line that says why not.

    `where` is the function and parameter, "elaphe_like: depth"; `unit` is what to call it, " µm".
    """
    ok = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not ok or not least <= float(value) <= most:  # NaN fails too
        raise DiffractionError(
            f"{where}: expected a number{unit and ' in'}{unit} from {least:g} to {most:g}, "
            f"got {quoted(value)}"
        )
    return float(value)


def count_between(value: int, where: str, least: int, most: int) -> int:
    """`value` as an int between `least` and `most`, ends included."""
    ok = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not ok or not least <= int(value) <= most:
        raise DiffractionError(
            f"{where}: expected a whole number from {least} to {most}, got {quoted(value)}"
        )
    return int(value)


def length_pair(value: Lengths, where: str, least: float, most: float) -> tuple[float, float]:
    """(along x, along y) in µm from one length for both or a pair."""
    first, second = _pair(value, where)
    return (
        number_between(first, where, least, most, " µm"),
        number_between(second, where, least, most, " µm"),
    )


def count_pair(value: Counts, where: str, least: int, most: int) -> tuple[int, int]:
    """(along x, along y) from one count for both or a pair."""
    first, second = _pair(value, where)
    return count_between(first, where, least, most), count_between(second, where, least, most)


def seed_of(value: int, where: str) -> int:
    """A seed for NumPy's generators: a whole number from 0 to 2⁶³ − 1."""
    return count_between(value, where, 0, 2**63 - 1)


def _pair(value: object, where: str) -> tuple[Any, Any]:
    if not isinstance(value, (list, tuple)):
        return value, value
    if len(value) != 2:
        raise DiffractionError(
            f"{where}: expected one number or a pair (along x, along y), got {quoted(value)}"
        )
    return value[0], value[1]
