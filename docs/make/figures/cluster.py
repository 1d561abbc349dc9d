"""Figures of docs/cluster.md: a film on two workers beside one process, and simulated clusters.

python -m docs.make.figures.cluster scenes/plate.xml -o docs/cluster.md

Renders a film of 16 frames twice, with two threads in one process and with one in each of two
workers; measures what the client and the scheduler do for a task; and simulates clusters of up to
1,000 workers with these times.
"""

from __future__ import annotations

import argparse
import heapq
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_diffraction.cluster.frames import Kept
from mitsuba_diffraction.cluster.tasks import SceneFiles, Sums, Task
from mitsuba_diffraction.extras import optional

from . import pages
from .pages import exit_code

FRAMES = 16
WORKERS = (1, 2, 10, 30, 100, 300, 1000)
#: What is simulated: a film of 2,000 frames of 1,024 samples, 1,024 × 640 pixels of 4 channels.
TASKS, PIXELS, CHANNELS = 2000 * 320 // 8, 1024 * 640, 4


@dataclass(frozen=True)
class Costs:
    """Seconds of a task."""

    work: float  # of a worker
    spread: float  # standard deviation of that
    scheduler: float  # of the scheduler, for one task after the other
    client: float  # of the client: to receive, write, read and add a sum
    transfer: float  # of the client's network, for a sum


def simulate(workers: int, tasks: int, costs: Costs, ahead: int = 3, seed: int = 0) -> float:
    """Seconds until the last sum is added up.

    Scheduler and client do one thing at a time, a worker one task. The client gives out a task for
    each that it has taken in, `ahead` for every worker at first, as `cluster.frames` does.
    """
    rng = np.random.default_rng(seed)
    scheduler = client = 0.0
    free = [0.0] * workers
    heapq.heapify(free)
    done: list[float] = []
    submitted = 0

    def give(now: float) -> None:
        nonlocal scheduler, submitted
        scheduler = max(scheduler, now) + costs.scheduler
        start = max(heapq.heappop(free), scheduler)
        end = start + max(0.1 * costs.work, rng.normal(costs.work, costs.spread))
        heapq.heappush(free, end)
        heapq.heappush(done, end)
        submitted += 1

    while submitted < min(tasks, ahead * workers):
        give(0.0)
    while done:
        client = max(client, heapq.heappop(done)) + max(costs.client, costs.transfer)
        if submitted < tasks:
            give(client)
    return client


def film_seconds(
    scene: Path, frames: int, more: Sequence[str] = ()
) -> tuple[float, dict[str, Any]]:
    """Seconds of the command for so many frames, start included, and its report."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "report.json")
        command = [
            sys.executable, "-m", "mitsuba_diffraction", "render", str(scene),
            "--frames", str(frames), "-m", "llvm_ad_rgb", "-D", "resx=240", "-D", "resy=200",
            "-s", "32", "--no-progress", "--animate", "lamp_azimuth=0:90",
            "-o", str(Path(folder, "film")), "--json", str(report), *more,
        ]  # fmt: skip
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - start, json.loads(report.read_text("utf-8"))


def client_seconds(count: int = 20) -> float:
    """Seconds that the client spends on one sum: written, read, added."""
    task = Task(SceneFiles("scene", (), ()), "", 0, False, "", 0, 0, (), (), 1)
    rng = np.random.default_rng(0)
    raw = rng.random((640, PIXELS // 640, CHANNELS)).astype(np.float32).astype(np.float64)
    total = np.zeros_like(raw)
    with tempfile.TemporaryDirectory() as folder:
        store = Kept(Path(folder) / "passes")
        start = time.perf_counter()
        for _ in range(count):
            store.write(task, Sums(raw, "", "", 0.0, 0))
            stored = store.read(task)
            assert stored is not None
            total += stored.raw
            store.forget(task)
        return (time.perf_counter() - start) / count


def scheduler_seconds(count: int = 500) -> float:
    """Seconds of client, scheduler and worker together for an empty task, one after the other
    in the queue: more than the scheduler's own."""
    distributed = optional("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as local,
        distributed.Client(local) as client,
    ):
        client.gather(client.map(abs, range(10), pure=False))
        start = time.perf_counter()
        client.gather(client.map(abs, range(count), pure=False))
        return (time.perf_counter() - start) / count


def scaling(costs: Costs) -> str:
    """The table of simulated clusters."""
    rows = []
    for workers in WORKERS:
        seconds = simulate(workers, TASKS, costs)
        ideal = TASKS * costs.work / workers
        rows.append((f"{workers:,}", f"{seconds / 3600:.3g} h", f"{ideal / seconds:.0%}"))
    return pages.table(("workers", f"{TASKS:,} tasks take", "of the ideal"), rows)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, simulate, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/cluster.md"))
    parser.add_argument("--work", type=float, default=20.0, help="simulated seconds of a task")
    args = parser.parse_args(argv)

    def work() -> None:
        film_seconds(args.scene, 1)  # makes the table, and caches it
        alone = film_seconds(args.scene, FRAMES)[1]["seconds"]
        two_workers, workers_report = film_seconds(
            args.scene, FRAMES, ["--workers", "2", "--threads", "1"]
        )
        report = workers_report["workers"]
        seconds = report["seconds"]
        scheduler, client = scheduler_seconds(), client_seconds()
        transfer = PIXELS * CHANNELS * 8 / 1.25e8
        costs = Costs(args.work, 0.15 * args.work, scheduler, client, transfer)
        film = (
            f"A film of {FRAMES} frames takes {alone:.0f} s in one process with two threads. Two "
            f"workers with one thread each take {seconds:.0f} s, {seconds / alone:.2f} times as "
            f"long, and {two_workers - seconds:.0f} s to start; "
            f"{report['overhead_per_task_s']:.2g} s a task are not work."
        )
        times = (
            f"Measured: {1e3 * scheduler:.2g} ms a task for the scheduler, {1e3 * client:.3g} ms "
            f"for the client to write, read and add a sum of {PIXELS * CHANNELS * 8 / 1e6:.3g} "
            f"MB. Assumed: tasks of {args.work:g} ± {0.15 * args.work:g} s, and 1 Gbit/s to the "
            f"client, {1e3 * transfer:.3g} ms a sum."
        )
        print(film, times, scaling(costs), sep="\n\n")
        pages.update(args.output, {"film": film, "times": times, "scaling": scaling(costs)})

    return exit_code("cluster", work)


if __name__ == "__main__":
    sys.exit(main())
