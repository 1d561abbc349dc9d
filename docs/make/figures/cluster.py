"""Figures of docs/cluster.md: a film on two workers beside one process, and simulated clusters.

python -m docs.make.figures.cluster scenes/plate.xml -o docs/cluster.md

Renders a film of 16 frames five times by turns in one process with two threads and on two workers
with one; measures what a pass, the client, the scheduler and an addition cost; and simulates jobs
on clusters of up to 3,000 workers with these costs. All that is measured is processor time, which
other programs on the machine hardly change.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mitsuba_diffraction.cluster.frames import FrameRequest, FrameSequence
from mitsuba_diffraction.cluster.kept import Kept
from mitsuba_diffraction.cluster.tasks import SceneFiles, Sums, Task, add_sums
from mitsuba_diffraction.cluster.workers import connect
from mitsuba_diffraction.errors import warn
from mitsuba_diffraction.extras import optional
from mitsuba_diffraction.progress import silent
from mitsuba_diffraction.scene.load import load_scene, set_variant
from mitsuba_diffraction.scene.passes import (
    Pass,
    Span,
    Stop,
    render_pass,
    render_passes,
    samples_per_pass,
)

from . import pages
from .cluster_simulation import Costs, Job, Simulation
from .pages import exit_code

VARIANT, SPP = "llvm_ad_rgb", 32
FRAMES, RUNS = 16, 5
WORKERS = (10, 100, 1000, 3000)
FILM, STILL = Job(2000, 1024, 640, 1024), Job(1, 3840, 2160, 65_536)
#: Network of every machine, in bytes a second, and the spread of the times of tasks: assumed.
NETWORK, SPREAD = 1.25e8, 0.15


class Times(NamedTuple):
    """Seconds: of the clock, and of processors."""

    clock: float
    processor: float


def requests(frames: int) -> list[FrameRequest]:
    """Return frames of 240 × 200 pixels, in which the lamp turns by 90°."""
    angles = np.linspace(0.0, 90.0, frames)
    size = {"resx": "240", "resy": "200"}
    return [FrameRequest({**size, "lamp_azimuth": str(angle)}, SPP, 0) for angle in angles]


def processor_of(client: Any) -> float:
    """Return the processor seconds so far of workers and of this process, with the scheduler."""
    return time.process_time() + sum(client.run(time.process_time).values())


def on_workers(client: Any, scene: Path, frames: int) -> Times:
    """Render the film on workers; their processor time, and the client's."""

    set_variant(VARIANT)
    with tempfile.TemporaryDirectory() as folder:
        film = FrameSequence(
            client, scene, requests(frames), VARIANT, keep=Path(folder, "passes"), warn=warn,
            threads=1,
        )  # fmt: skip
        start, before = time.perf_counter(), processor_of(client)
        assert len(list(film.render(Stop(), silent))) == frames
        return Times(time.perf_counter() - start, processor_of(client) - before)


def in_one_process(scene: Path, frames: int) -> Times:
    """Render the film in this process with two threads."""
    import drjit as dr

    set_variant(VARIANT)
    dr.set_thread_count(2)
    start, before = time.perf_counter(), time.process_time()
    for frame in requests(frames):
        loaded = load_scene(scene, frame.values)
        render_passes(
            loaded, loaded.sensors()[0], spp=SPP, seed=0, variant=VARIANT, stop=Stop(),
            progress=silent,
        )  # fmt: skip
    return Times(time.perf_counter() - start, time.process_time() - before)


class FilmTimes(NamedTuple):
    """Times of the film, of one process and of two workers, in runs by turns."""

    single: list[Times]
    workers: list[Times]
    idle: float  # processor seconds of client, scheduler and workers in a second without work

    def ratios(self) -> list[float]:
        """Processor time of workers, as it is on two free cores, over that of one process.

        A busy machine stretches the film, and with it the time that Dask's processes take without
        work.
        """
        return [
            (workers.processor - self.idle * workers.clock) / (1 - self.idle / 2) / single.processor
            for single, workers in zip(self.single, self.workers, strict=True)
        ]


def film_times(scene: Path) -> FilmTimes:
    """Render the film by turns in one process and on two workers."""
    with ProcessPoolExecutor(1, get_context("spawn")) as alone, connect(2) as client:

        def turn(frames: int) -> tuple[Times, Times]:
            single = alone.submit(in_one_process, scene, frames).result()
            return single, on_workers(client, scene, frames)

        turn(2)  # makes tables and kernels, and caches them
        before = processor_of(client)
        time.sleep(10.0)
        idle = (processor_of(client) - before) / 10.0
        single, workers = zip(*(turn(FRAMES) for _ in range(RUNS)), strict=True)
        return FilmTimes(list(single), list(workers), idle)


def processor_seconds(work: Callable[[], Any]) -> float:
    """Return the processor seconds of a call."""
    start = time.process_time()
    work()
    return time.process_time() - start


def costs_of_passes(scene: Path) -> tuple[float, float]:
    """Return seconds on two cores for a sample, and for the scene and kernels of a frame."""
    import drjit as dr

    set_variant(None)
    dr.set_thread_count(2)
    loaded: list[Any] = []
    load = processor_seconds(lambda: loaded.append(load_scene(scene, {})))
    sensor = loaded[0].sensors()[0]
    pixels = int(np.prod(sensor.film().crop_size()))
    spp = samples_per_pass(2**30, pixels, "llvm")
    first, *others = (
        processor_seconds(partial(render_pass, loaded[0], sensor, Pass(seed, spp)))
        for seed in range(4)
    )
    each = statistics.median(others)
    return each / 2 / (spp * pixels), load + max(0.0, first - each)


def costs_of_sums(count: int = 20) -> tuple[float, float]:
    """Return seconds of the client and of an addition, for a byte of a sum of the film."""
    task = Task(SceneFiles("scene", (), ()), "", 0, False, "", 0, Span(0, 1), (), (), 1)
    raw = np.random.default_rng(0).random((FILM.height, FILM.width, 4), np.float32)
    sums = Sums(raw, (), (), 1, 0.0, 0)
    with tempfile.TemporaryDirectory() as folder:
        store = Kept(Path(folder) / "passes")

        def take() -> None:
            store.write(task, task.span, sums)
            stored = store.read(task, task.span)
            assert stored is not None
            add_sums([sums, stored])

        client = statistics.median(processor_seconds(take) for _ in range(count))
    large = [Sums(np.ones(STILL.bytes // 4, np.float32), (), (), 1, 0.0, 0) for _ in range(2)]
    addition = statistics.median(processor_seconds(lambda: add_sums(large)) for _ in range(5))
    return client / raw.nbytes, addition / STILL.bytes


def scheduler_seconds(count: int = 1000) -> float:
    """Seconds of client and scheduler, in one process, for an empty task among many."""
    distributed = optional("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
        ) as local,
        distributed.Client(local) as client,
    ):

        def work() -> None:
            client.gather([client.submit(abs, n, pure=False) for n in range(count)])

        work()
        return processor_seconds(work) / count


def scaling(costs: Costs) -> str:
    """The sentence on simulated clusters: their speed relative to the ideal."""
    parts = []
    for name, job in (("animation", FILM), ("still", STILL)):
        shares = [
            f"{job.work(costs) / workers / Simulation(job, workers, costs).seconds():.0%}"
            for workers in WORKERS
        ]
        hours = job.work(costs) / 3600
        parts.append(f"{name} {', '.join(shares)} ({hours:.0f} h on one worker)")
    workers = ", ".join(f"{count:,}" for count in WORKERS)
    return f"Speed of {workers} workers relative to the ideal: {'; '.join(parts)}."


def film_text(times: FilmTimes) -> str:
    """The sentence on a film on two workers."""
    ratios = times.ratios()
    return (
        f"An animation of {FRAMES} frames on two workers with one thread each takes "
        f"{statistics.median(ratios):.2f} times the processor time of one process with two "
        f"threads, with client and scheduler (median of {RUNS} runs, {min(ratios):.2f} to "
        f"{max(ratios):.2f})."
    )


def job_text(job: Job) -> str:
    """The size of a job."""
    frames = f"{job.frames:,} frames of " if job.frames > 1 else ""
    return (
        f"{frames}{job.width:,} × {job.height:,} pixels at {job.spp:,} samples, a sum of "
        f"{job.bytes / 1e6:.3g} MB"
    )


def costs_text(costs: Costs) -> str:
    """Return the assumptions of the simulation, in words."""
    return (
        f"Assumed: workers of two cores ({costs.sample * 2**21:.2g} s for a pass of the snake), "
        f"tasks that vary by {costs.spread:.0%}, {8e-9 / costs.network:g} Gbit/s, no failures. "
        f"Animation: {job_text(FILM)}. Still: {job_text(STILL)}."
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, simulate, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path, help="of the film")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/cluster.md"))
    parser.add_argument(
        "--simulated", type=Path, default=Path("scenes/snake.xml"),
        help="scene of the simulated jobs; default: %(default)s",
    )  # fmt: skip
    args = parser.parse_args(argv)

    def work() -> None:
        film = film_text(film_times(args.scene))
        sample, load = costs_of_passes(args.simulated)
        client, addition = costs_of_sums()
        costs = Costs(
            sample, SPREAD, load, scheduler_seconds(), client, addition, 1 / NETWORK
        )  # fmt: skip
        parts = {"film": film, "times": costs_text(costs), "scaling": scaling(costs)}
        print(*parts.values(), sep="\n\n")
        pages.update(args.output, parts)

    return exit_code("cluster", work)


if __name__ == "__main__":
    sys.exit(main())
