"""Kernel times of BSDFs: random queries, alternating rounds through all candidates, ratios."""

from __future__ import annotations

import os
import re
import statistics
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionWarning
from ..plugin.dictionary import bsdf_dict
from ..tables.table import DiffractionTable

#: Pixel size in µm of the patches that are timed: 1332 pixels span the default coherence window.
PIXEL = 65.0 / 1332
#: Seed of the random directions and wavelengths.
SEED = 20140113
Measured = TypeVar("Measured")
#: Calls before the first that counts: the first one compiles, the second one wakes the processor.
WARM_UP = 2


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


def kernel_seconds(call: Callable[[], Any]) -> float:
    """Return the execution time of the kernels of one call, s, without tracing in Python."""
    return kernel_time(call).seconds


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


def rounds_of(
    calls: Mapping[str, Callable[[], Measured]], rounds: int, done: Callable[[int, int], None]
) -> dict[str, list[Measured]]:
    """Return what every call measures in every round; each round goes through all calls in turn.

    Background load then affects all candidates equally, and ratios within a round are reliable.
    """
    seconds: dict[str, list[Measured]] = {name: [] for name in calls}
    for n in range(WARM_UP + rounds):
        for name, call in calls.items():
            elapsed = call()
            if n >= WARM_UP:
                seconds[name].append(elapsed)
        done(n + 1, WARM_UP + rounds)
    return seconds


def ratio(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the median of a/b over the rounds."""
    return statistics.median(x / y for x, y in zip(a, b, strict=True))


def quiet_bsdf(table: DiffractionTable | str | os.PathLike[str], **parameters: Any) -> Any:
    """Load the plugin with a table, without warnings about the model's limits."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return mi.load_dict(bsdf_dict(table, **parameters))


@dataclass(frozen=True)
class Queries:
    """Random arguments of a BSDF's methods, evaluated to memory."""

    si: Any
    wo: Any
    sample1: Any
    sample2: Any

    @classmethod
    def random(cls, lanes: int) -> Queries:
        """Draw directions and texture coordinates uniformly, and wavelengths as Mitsuba does."""
        random = mi.PCG32(size=lanes, initstate=SEED)

        def hemisphere() -> Any:
            pair = mi.Point2f(random.next_float32(), random.next_float32())
            return mi.warp.square_to_uniform_hemisphere(pair)

        si = dr.zeros(mi.SurfaceInteraction3f, lanes)
        si.wi = hemisphere()
        wo = hemisphere()
        if mi.is_spectral:
            si.wavelengths = mi.sample_rgb_spectrum(mi.sample_shifted(random.next_float32()))[0]
        sample1 = random.next_float32()
        sample2 = mi.Point2f(random.next_float32(), random.next_float32())
        si.uv = mi.Point2f(random.next_float32(), random.next_float32())
        dr.eval(si, wo, sample1, sample2)
        return cls(si, wo, sample1, sample2)
