"""Checks of single values that are read from files: type, size and range.

Each raises a ValueError that names the value, which the reader of the file turns into its message.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import quoted


def require(fits: bool | np.bool_, what: str) -> None:
    """Refuse what does not fit; what : names it, with its value."""
    if not fits:
        raise ValueError(f"{what} does not fit")


def mapping(value: Any, name: str) -> Mapping[str, Any]:
    """Return an object of JSON."""
    require(isinstance(value, dict), name)
    return value


def list_of(value: Any, name: str) -> list[Any]:
    """Return a list."""
    require(isinstance(value, list | tuple), name)
    return list(value)


def check_names(fields: Iterable[str], allowed: Iterable[str], required: Iterable[str]) -> None:
    """Refuse names that are not allowed, and missing ones that are required."""
    missing, unknown = set(required) - set(fields), set(fields) - set(allowed)
    if missing:
        raise ValueError(f"missing entries: {', '.join(sorted(missing))}")
    if unknown:
        raise ValueError(f"unknown entry {quoted(min(unknown))}")


def number(value: Any, name: str, low: float, high: float) -> float:
    """Return a number from low to high."""
    real = isinstance(value, int | float) and not isinstance(value, bool)
    require(real and low <= value <= high, f"{name}={quoted(value)}")
    return float(value)


def whole(value: Any, name: str, low: int, high: int) -> int:
    """Return a whole number from low to high."""
    require(type(value) is int and low <= value <= high, f"{name}={quoted(value)}")
    return int(value)


def pair(
    value: Any, name: str, low: float, high: float, kind: Callable[..., Any] = number
) -> tuple[Any, Any]:
    """Return two numbers from low to high, each checked by `kind`."""
    parts = list_of(value, name)
    require(len(parts) == 2, f"{name}={quoted(value)}")
    x, y = (kind(part, name, low, high) for part in parts)
    return x, y


def numbers(value: Any, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Return finite numbers of a shape, None for any size."""
    array = np.array(value)
    right = len(shape) == array.ndim and all(
        n in (None, m) for n, m in zip(shape, array.shape, strict=True)
    )
    require(right and array.dtype.kind in "if", f"{name} of shape {array.shape}")
    require(np.isfinite(array).all() and np.abs(array).max(initial=0.0) < 1e12, name)
    return array.astype(float)
