"""Rendering in passes, so that there is progress to show and Ctrl-C keeps the picture so far.

A seed gives the same random numbers everywhere, and with one Dr.Jit thread the same picture bit for
bit. Several threads add their samples to the film in the order in which they finish, in single
precision, so that two runs of one process agree within 1e-6 of the film's largest value. Filters
wider than a pixel, such as the default, make threads meet in most pixels.

Passes are added up in pairs, in a binary tree that their number alone decides, so that any part of
the tree may be added anywhere. A sum of n passes in single precision then errs by a relative
log2(n) * 6e-8 at most (pairwise summation: N. J. Higham, SIAM J. Sci. Comput. 14, 783, 1993).
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType
from typing import Any, Self

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..plugin.memory import tensor
from ..progress import Progress
from .mitsuba_errors import error_of

#: Samples in a pass: seconds on a few cores, well below a second on a GPU, and far from where
#: wavefronts exhaust the memory. Fixed, so that a seed gives the same random numbers everywhere.
SAMPLES = {"llvm": 2**21, "cuda": 2**24, "metal": 2**24}


@dataclass(frozen=True)
class Result:
    """Picture of a rendering (a `mi.Bitmap`), its samples per pixel, and whether Ctrl-C ended it.

    Without samples the bitmap is None.
    """

    bitmap: Any
    spp: int
    interrupted: bool


class Stop:
    """Inside, Ctrl-C only sets `asked`; a second Ctrl-C raises KeyboardInterrupt."""

    def __init__(self) -> None:
        self.asked = False
        self._before: Any = None

    def __enter__(self) -> Self:
        ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN  # a job in the background
        if threading.current_thread() is threading.main_thread() and not ignored:
            self._before = signal.signal(signal.SIGINT, self._ask)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True


def samples_per_pass(spp: int, pixels: int) -> int:
    """Return how many of `spp` samples per pixel to take at once.

    Passes of one size share one kernel, so a divisor of `spp` is taken if one is large enough.
    """
    most = max(1, SAMPLES.get(str(mi.variant()).split("_")[0], 0) // pixels)
    if spp <= most:
        return spp
    for size in range(most, max(1, most // 2) - 1, -1):
        if spp % size == 0:
            return size
    return most


@dataclass(frozen=True)
class Pass:
    """A pass: the seed of its random numbers, and its samples per pixel."""

    seed: int
    spp: int


def passes_of(sensor: Any, spp: int, seed: int) -> list[Pass]:
    """List the passes that take `spp` samples per pixel, or a few more for stratified samplers.

    Parameters as in `render_passes`.
    """
    sampler, seeds = sensor.sampler(), np.random.SeedSequence(seed)
    size = samples_per_pass(spp, int(np.prod(sensor.film().crop_size())))
    result, done = [], 0
    while done < spp:
        sampler.set_sample_count(min(size, spp - done))
        (sequence,) = seeds.spawn(1)
        result.append(Pass(int(sequence.generate_state(1)[0]), int(sampler.sample_count())))
        done += result[-1].spp
    return result


@dataclass(frozen=True)
class Span:
    """Consecutive passes: number of the first, and how many.

    In the tree of additions, a span starts at a multiple of the power of two that holds its count.
    """

    first: int
    count: int

    def pieces(self, size: int) -> list[Span]:
        """Cut into spans of `size`, a power of two; the last may be shorter."""
        end = self.first + self.count
        return [Span(n, min(size, end - n)) for n in range(self.first, end, size)]

    def halves(self) -> list[Span]:
        """Cut a span of two passes or more where the tree branches."""
        return self.pieces(1 << (self.count - 1).bit_length() - 1)

    def __str__(self) -> str:
        last = self.first + self.count - 1
        return f"pass {last}" if self.count == 1 else f"passes {self.first} to {last}"


def added(span: Span, sum_of: Callable[[Span], Any]) -> Any:
    """Add up passes in their tree.

    At most log2(n) + 1 sums exist at a time besides the two that are being added.

    span : the passes.
    sum_of : gives the sum of a span, or None to have it added from its halves; it must give the
        sum of single passes.
    """
    value = sum_of(span)
    if value is not None:
        return value
    left, right = (added(half, sum_of) for half in span.halves())
    return left + right


def render_pass(scene: Any, sensor: Any, each: Pass) -> NDArray[np.floating[Any]]:
    """Return the film's raw storage after a pass: weighted sums beside the sums of the weights.

    Raises a DiffractionError if Mitsuba refuses or fails to render.
    """
    integrator, film = integrator_of(scene), sensor.film()
    try:
        integrator.render(scene, sensor, seed=each.seed, spp=each.spp, develop=False)
        raw = np.array(film.develop(raw=True))
    except RuntimeError as error:
        raise error_of("cannot render", error) from error
    return raw * each.spp if _splats(integrator) else raw


def developed(scene: Any, sensor: Any, total: NDArray[np.floating[Any]], spp: int) -> Any:
    """Return the picture, a `mi.Bitmap`, of a sum of passes with `spp` samples per pixel in all."""
    integrator, film = integrator_of(scene), sensor.film()
    if _splats(integrator):
        total = total / spp
    film.prepare(integrator.aov_names())
    offset: Any = mi.ScalarPoint2i(film.crop_offset())
    film.put_block(mi.ImageBlock(tensor(total), offset))
    return film.bitmap()


def integrator_of(scene: Any) -> Any:
    """Return the scene's integrator.

    Raises a DiffractionError without an integrator.
    """
    integrator = scene.integrator()
    if integrator is None:
        raise DiffractionError("the scene has no integrator; add <integrator type='path'/>")
    return integrator


def _splats(integrator: Any) -> bool:
    """Whether the integrator splats estimates without weights, so that an average needs them."""
    return isinstance(integrator, mi.AdjointIntegrator)


def render_passes(
    scene: Any, sensor: Any, *, spp: int, seed: int, stop: Stop, progress: Progress
) -> Result:
    """Render `spp` samples per pixel as the average over passes, exactly as one pass would.

    The films' raw storage, filter-weighted sums of radiance beside the sums of the weights, is
    added up and put back into the film, which then divides and converts to its own format.
    Averages of finished pictures would differ where pixels share samples.

    scene, sensor : of the variant that is set.
    spp : samples per pixel; stratified samplers round it up, and the result says to what.
    seed : whole number from 0; each pass gets its own, derived from it.
    stop : asked, it ends the rendering after the current pass.
    progress : called as progress(samples done, samples in all, activity).

    Raises a DiffractionError if Mitsuba refuses or fails to render.
    """
    integrator_of(scene)
    progress(0, spp, "compiling")
    done = 0
    passes = passes_of(sensor, spp, seed)

    def sum_of(span: Span) -> Any:
        nonlocal done
        if stop.asked:
            return 0.0
        if span.count > 1:
            return None
        each = passes[span.first]
        raw = render_pass(scene, sensor, each)
        if stop.asked and str(mi.variant()).startswith("scalar"):
            return 0.0  # Mitsuba left this pass unfinished; a JIT variant never does
        done += each.spp
        progress(min(done, spp), spp, "rendering")
        return raw

    total = added(Span(0, len(passes)), sum_of)
    if done == 0:  # asked to stop before there was anything
        return Result(None, 0, stop.asked)
    try:
        return Result(developed(scene, sensor, total, done), done, stop.asked)
    except RuntimeError as error:
        raise error_of("cannot render", error) from error
