"""Checks of the lengths (µm) and counts that users write as numbers or strings."""

from __future__ import annotations

import math
import numbers
import re
import unicodedata
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..errors import DiffractionError, quoted

# Limits in µm: a pixel below the size of an atom or a height above 10 mm is a mistake of units.
SHORTEST_PIXEL = 1e-5
LONGEST_PIXEL = 1e3
LONGEST_HEIGHT = 1e4

#: µm per unit of length that files may state; names after NFKC, which unites µ and μ, Å and Å.
UNITS = {
    "m": 1e6, "cm": 1e4, "mm": 1e3, "\u03bcm": 1.0, "um": 1.0, "nm": 1e-3, "pm": 1e-6,
    "\u00c5": 1e-4,
}  # fmt: skip

_WORDS = {
    f"{prefix}met{end}": UNITS[unit]
    for prefix, unit in (("nano", "nm"), ("micro", "um"), ("milli", "mm"))
    for end in ("er", "re")
} | {"micron": 1.0, "angstrom": 1e-4}

PixelSize = float | str | Iterable[float]
Crop = PixelSize
Height = float | str


def pixel_size_of(value: PixelSize | None, where: str = "pixel_size") -> tuple[float, float] | None:
    """Return the pixel size (dx, dy) in µm from a number, a pair, "0.05", "0.05, 0.1", or "auto".

    `None` and "auto" give `None`: the file has to state it.

    Raises a DiffractionError if the value is not one of these; `where` names the parameter.
    """
    if is_auto(value):
        return None
    try:
        lengths = numbers_within(value, (1, 2), SHORTEST_PIXEL, LONGEST_PIXEL)
    except ValueError:
        raise DiffractionError(
            f"{where}: expected one length or a pair (dx, dy) in µm, each from {SHORTEST_PIXEL:g} "
            f"to {LONGEST_PIXEL:g}, or 'auto'; got {quoted(value)}"
        ) from None
    return lengths[0], lengths[-1]


def micrometres_of(unit: str) -> float | None:
    """Return how many µm one `unit` of length is, or `None` if the unit is unknown."""
    name = unicodedata.normalize("NFKC", unit.strip())
    return UNITS.get(name, _WORDS.get(name.lower().removesuffix("s")))


def height_unit_of(value: str | None) -> str | None:
    """Check a unit of length; `None` and "auto" give `None`: the file has to state it.

    Raises a ValueError for other values, as the other checks below.
    """
    if is_auto(value):
        return None
    if not isinstance(value, str) or micrometres_of(value) is None:
        raise ValueError
    return value.strip()


def crop_of(value: Crop | None) -> tuple[float, ...] | None:
    """Return (width, height) or (width, height, x, y) in µm from a number, 2, 4, or a string.

    `None` and "none" give `None`: no crop.
    """
    if is_auto(value, "none"):
        return None
    lengths = numbers_within(value, (1, 2, 4), 0.0, math.inf)
    if not min(lengths[:2]) > 0.0:
        raise ValueError
    return lengths if len(lengths) > 1 else (lengths[0], lengths[0])


def is_auto(value: object, word: str = "auto") -> bool:
    """Return whether a value is `None` or the word: with "auto" the file has to state it."""
    return value is None or (isinstance(value, str) and value.strip().lower() == word)


def numbers_of(value: object) -> tuple[float, ...] | None:
    """Return the floats in a number, numeric string or short sequence, or `None` for others."""
    if isinstance(value, str):
        parts: list[Any] = [part for part in re.split(r"[,\s]+", value.strip()) if part]
    else:
        listed = value.ravel() if isinstance(value, np.ndarray) else value
        parts = list(listed[:5] if isinstance(listed, tuple | list | np.ndarray) else [listed])
        if any(isinstance(n, bool | np.bool_) or not isinstance(n, numbers.Real) for n in parts):
            return None
    try:
        result = tuple(float(part) for part in parts)
    except (ValueError, OverflowError):
        return None
    return result if all(map(math.isfinite, result)) else None


def numbers_within(
    value: object, counts: Sequence[int], least: float, most: float
) -> tuple[float, ...]:
    """Return `numbers_of` a value; a ValueError unless so many lie from `least` to `most`."""
    found = numbers_of(value) or ()
    if len(found) not in counts or not all(least <= number <= most for number in found):
        raise ValueError
    return found


def number_between(value: float, where: str, least: float, most: float, unit: str = "") -> float:
    """Check that `value` is a number from `least` to `most` and return it as a float.

    `where` names function and parameter in the error, "elaphe_like: depth"; `unit` is for instance
    " µm".
    """
    ok = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not ok or not least <= float(value) <= most:  # NaN fails too
        raise DiffractionError(
            f"{where}: expected a number{unit and ' in'}{unit} from {least:g} to {most:g}, "
            f"got {quoted(value)}"
        )
    return float(value)


def count_between(value: int, where: str, least: int, most: int) -> int:
    """Check that `value` is a whole number from `least` to `most` and return it as an int."""
    ok = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not ok or not least <= int(value) <= most:
        raise DiffractionError(
            f"{where}: expected a whole number from {least} to {most}, got {quoted(value)}"
        )
    return int(value)
