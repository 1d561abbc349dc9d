"""Random damage to nested data."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def mutate(rng: np.random.Generator, document: Any) -> None:
    """Replace a value somewhere in nested data, or leave it out."""
    place = document
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = keys[rng.integers(len(keys))]
        if not isinstance(place[key], (dict, list)) or not place[key] or rng.random() < 0.15:
            break
        place = place[key]
    if rng.random() < 0.1:
        del place[key]
        return
    old = place[key]
    numbers = [-1, 0, 1, 2, 3, 1000, 10**12, 0.5, 1e-30, 1e30, 1e300, math.nan, math.inf]
    words: list[Any] = [None, True, "", "patch", "ensemble", "svd", [], {}, [1, 2], [[1.0]]]
    if isinstance(old, (int, float)) and not isinstance(old, bool) and rng.random() < 0.7:
        words = [old * 2, old + 1, -old, old * (1 + 1e-3), *numbers]
    place[key] = [*words, *numbers][rng.integers(len(words) + len(numbers))]
