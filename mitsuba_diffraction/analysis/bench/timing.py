"""Timing kernels side by side."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import drjit as dr

#: Calls before the first that counts: the first compiles, the second finds the processor awake.
WARM_UP = 2


def kernel_seconds(call: Callable[[], Any]) -> float:
    """Time that the kernels of one call take, without what Python needs to put them together."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(call())
        dr.sync_thread()
        return sum(entry["execution_time"] for entry in dr.kernel_history()) * 1e-3


def rounds_of(
    calls: Mapping[str, Callable[[], float]], rounds: int, done: Callable[[int, int], None]
) -> dict[str, list[float]]:
    """Seconds of every call in every round; each round goes through all of them in turn.

    So background load affects all candidates alike, and ratios within a round can be trusted.
    """
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for n in range(WARM_UP + rounds):
        for name, call in calls.items():
            took = call()
            if n >= WARM_UP:
                seconds[name].append(took)
        done(n + 1, WARM_UP + rounds)
    return seconds


def ratio(a: Sequence[float], b: Sequence[float]) -> float:
    """Median over the rounds of a/b."""
    return statistics.median(x / y for x, y in zip(a, b, strict=True))
