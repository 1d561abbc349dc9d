"""Figure of docs/cluster.md: a film on two workers beside one process.

python -m docs.make.figures.cluster scenes/plate.xml -o docs/cluster.md

Renders a film of 16 frames five times by turns in one process with two threads and on two workers
with one. Processor time is measured, which other programs on the machine hardly change.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mitsuba_diffraction.cluster import FrameRequest, FrameSequence, connect
from mitsuba_diffraction.orders.solve import jobs
from mitsuba_diffraction.progress import silent
from mitsuba_diffraction.scene import Stop, load_scene, render_passes, set_variant

from . import pages
from .pages import Seconds, option, program

VARIANT, SPP = "llvm_ad_rgb", 32
FRAMES, RUNS = 16, 5


def requests(frames: int) -> list[FrameRequest]:
    """Return frames of 240 × 200 pixels, in which the lamp turns by 90°."""
    angles = np.linspace(0.0, 90.0, frames)
    size = {"resx": "240", "resy": "200"}
    return [FrameRequest({**size, "lamp_azimuth": str(angle)}, SPP, 0) for angle in angles]


def processor_of(client: Any) -> float:
    """Return the processor seconds so far of workers and of this process, with the scheduler."""
    return time.process_time() + sum(client.run(time.process_time).values())


def on_workers(client: Any, scene: Path, frames: int) -> Seconds:
    """Render the film on workers; their processor time, and the client's."""

    set_variant(VARIANT)
    with tempfile.TemporaryDirectory() as folder:
        film = FrameSequence(
            client, scene, requests(frames), VARIANT, keep=Path(folder, "passes"), threads=1,
        )  # fmt: skip
        start, before = time.perf_counter(), processor_of(client)
        assert len(list(film.render(Stop(), silent))) == frames
        return Seconds(time.perf_counter() - start, processor_of(client) - before)


def in_one_process(scene: Path, frames: int) -> Seconds:
    """Render the film in this process with two threads."""
    import drjit as dr

    set_variant(VARIANT)
    dr.set_thread_count(2)
    start, before = time.perf_counter(), time.process_time()
    for frame in requests(frames):
        loaded = load_scene(scene, frame.values)
        render_passes(
            loaded, loaded.sensors()[0], spp=SPP, seed=0, stop=Stop(),
            progress=silent,
        )  # fmt: skip
    return Seconds(time.perf_counter() - start, time.process_time() - before)


class FilmTimes(NamedTuple):
    """Times of the film, of one process and of two workers, in runs by turns."""

    single: list[Seconds]
    workers: list[Seconds]
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
    with jobs.processes(1) as alone, connect(2) as client:

        def turn(frames: int) -> tuple[Seconds, Seconds]:
            single = alone.submit(in_one_process, scene, frames).result()
            return single, on_workers(client, scene, frames)

        turn(2)  # makes tables and kernels, and caches them
        before = processor_of(client)
        time.sleep(10.0)
        idle = (processor_of(client) - before) / 10.0
        single, workers = zip(*(turn(FRAMES) for _ in range(RUNS)), strict=True)
        return FilmTimes(list(single), list(workers), idle)


def film_text(times: FilmTimes) -> str:
    """The sentence on a film on two workers."""
    ratios = times.ratios()
    return (
        f"An animation of {FRAMES} frames on two workers with one thread each takes "
        f"{statistics.median(ratios):.2f} times the processor time of one process with two "
        f"threads, with client and scheduler (median of {RUNS} runs, {min(ratios):.2f} to "
        f"{max(ratios):.2f})."
    )


@program(
    option("scene", type=Path, help="of the film"),
    option("-o", "--output", type=Path, default=Path("docs/cluster.md")),
)
def main(args: argparse.Namespace) -> None:
    """Measure, and write the page."""
    film = film_text(film_times(args.scene))
    print(film)
    pages.update(args.output, {"film": film})
