"""Dr.Jit's records of the kernels of a call: their time, operations and vectors."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from docs.make.figures.pages import Seconds
from mitsuba_diffraction.analysis.timing import kernel_records


def kernel_time(call: Callable[[], Any]) -> Seconds:
    """Return the time of the kernels of one call, without tracing in Python.

    The processors' time, with the start of kernels, is hardly changed by other processes.
    """
    kernels, cpu_seconds = kernel_records(call)
    return Seconds(sum(kernel["execution_time"] for kernel in kernels) * 1e-3, cpu_seconds)


def kernel_operations(call: Callable[[], Any]) -> int:
    """Return the number of Dr.Jit's operations in the kernels of one call, loops counted once."""
    return sum(kernel.get("operation_count", 0) for kernel in kernel_records(call)[0])


def vector_lanes() -> int:
    """Return how many lanes the processor's vectors have in kernels, 1 of a graphics card."""
    kernels, _ = kernel_records(lambda: dr.arange(mi.Float, 64) * 0.5)
    widths = re.findall(r"<(\d+) x float>", kernels[0]["ir"].getvalue())
    return max(map(int, widths), default=1)
