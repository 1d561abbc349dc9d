"""Kernel times of BSDFs: random queries, alternating rounds through all candidates, ratios."""

from __future__ import annotations

import os
import statistics
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi

from ..errors import DiffractionWarning
from ..heights import HeightField
from ..plugin.dictionary import bsdf_dict
from ..tables import DiffractionTable

#: Pixel size in µm of the patches that are timed: 1332 pixels span the default coherence window.
PIXEL = 65.0 / 1332
#: Seed of the random directions and wavelengths.
SEED = 20140113
Measured = TypeVar("Measured")
#: Calls before the first that counts: the first one compiles, the second one wakes the processor.
WARM_UP = 2


def kernel_seconds(call: Callable[[], Any]) -> float:
    """Return the execution time of the kernels of one call, s, without tracing in Python."""
    return 1e-3 * sum(kernel["execution_time"] for kernel in kernel_records(call)[0])


def kernel_records(call: Callable[[], Any]) -> tuple[list[dict[str, Any]], float]:
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


def quiet_bsdf(
    patch: HeightField | DiffractionTable | str | os.PathLike[str], **parameters: Any
) -> Any:
    """Load the plugin with a patch, without warnings about the model's limits."""
    with warnings.catch_warnings(action="ignore", category=DiffractionWarning):
        return mi.load_dict(bsdf_dict(patch, **parameters))


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
