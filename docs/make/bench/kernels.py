"""Dr.Jit's records of the kernels of a call: their time, operations and vectors."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi


class KernelTime(NamedTuple):
    """Time of the kernels of a call without tracing in Python, s.

    Attributes
    ----------
    seconds : on the clock.
    cpu_seconds : of all cores together, which other processes hardly change; with their start.
    """

    seconds: float
    cpu_seconds: float


def kernel_time(call: Callable[[], Any]) -> KernelTime:
    """Return the time of the kernels of one call."""
    kernels, cpu_seconds = _kernels(call)
    return KernelTime(sum(kernel["execution_time"] for kernel in kernels) * 1e-3, cpu_seconds)


def kernel_operations(call: Callable[[], Any]) -> int:
    """Return the number of Dr.Jit's operations in the kernels of one call, loops counted once."""
    return sum(kernel.get("operation_count", 0) for kernel in _kernels(call)[0])


def vector_lanes() -> int:
    """Return how many lanes the processor's vectors have in kernels, 1 of a graphics card."""
    kernels, _ = _kernels(lambda: dr.arange(mi.Float, 64) * 0.5)
    widths = re.findall(r"<(\d+) x float>", kernels[0]["ir"].getvalue())
    return max(map(int, widths), default=1)


def _kernels(call: Callable[[], Any]) -> tuple[list[dict[str, Any]], float]:
    """Run a call; return Dr.Jit's records of its kernels, and the processor's seconds."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        result = call()
        start = time.process_time()
        dr.eval(result)
        dr.sync_thread()
        return list(dr.kernel_history()), time.process_time() - start
