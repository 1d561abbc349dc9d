"""Frames of a scene from workers: shares to render, and pictures of their sums."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DiffractionError, warn
from ..progress import Progress, silent
from ..scene import load_scene, set_variant
from ..scene.load import preview_samples, sensor_of
from ..scene.passes import Result, Span, Stop, added, developed, integrator_of, passes_of
from .calls import Report
from .groups import Groups, Stopped, sums_in_worker
from .kept import Kept
from .tasks import SceneFiles, Task, film_of
from .workers import check_workers, warn_of_memory

#: Bytes that Dr.Jit takes for a sample of a pass, and for the rest of a process: estimates.
BYTES_A_SAMPLE, BYTES_A_PROCESS = 400, 5e8


def render(
    scene: str | os.PathLike[str],
    *,
    client: Any,
    parameters: Mapping[str, str] | None = None,
    spp: int | None = None,
    seed: int = 0,
    variant: str | None = None,
    sensor: int = 0,
    preview: bool = False,
    threads: int = 0,
    keep: str | os.PathLike[str] | None = None,
    progress: Progress = silent,
) -> Result:
    """Render a scene on the workers of a Dask cluster.

    Workers add up the passes, in the tree in which one process adds them (`scene.passes`). With
    `threads=1` the picture is, bit for bit, equal to the result of one process with one Dr.Jit
    thread on the same kind of processor. With several threads, passes agree within 1e-6 of the
    film's largest value.

    Raises a DiffractionError if a worker is of no use, or a task fails: with frame, passes and
    worker.

    Parameters
    ----------
    scene : XML file.
    client : `distributed.Client`; workers have one Dask thread each (`cluster.connect`).
    parameters : of the scene, by name.
    spp : samples per pixel; by default the scene's.
    seed : whole number from 0.
    variant : of Mitsuba; by default as `render` chooses it here.
    sensor : its number.
    preview : half the width and height, and at most 16 samples unless `spp` is given.
    threads : of Dr.Jit in every worker; 0 for one a core.
    keep : folder where sums of passes wait for the picture, and where a later call with the same
        arguments finds them; by default a temporary one.
    progress : called as progress(passes done, passes in all, text).

    Returns
    -------
    `scene.passes.Result`, with the picture as a `mi.Bitmap`.
    """
    name = set_variant(variant)
    with tempfile.TemporaryDirectory() as temporary, Stop() as stop:
        film = FrameSequence(
            client, Path(scene), [FrameRequest(dict(parameters or {}), spp, seed)], name,
            keep=Path(keep or Path(temporary) / "passes"), sensor=sensor, preview=preview,
            threads=threads,
        )  # fmt: skip
        results = list(film.render(stop, progress))
    if results:
        return results[0]
    raise DiffractionError("interrupted: finished passes are kept where `keep` says")


@dataclass(frozen=True)
class FrameRequest:
    """Request for a frame: values of the scene's parameters, samples (None: the scene's), seed."""

    values: Mapping[str, str]
    spp: int | None
    seed: int


class FrameSequence:
    """Frames of one scene, from workers.

    Raises a DiffractionError if the scene cannot be loaded, or a worker is of no use.

    Attributes
    ----------
    scene, sensor : of frame 0.
    frames : their passes.
    report : cost of the run.
    needed : estimate of a worker's memory in bytes.

    Parameters
    ----------
    client : `distributed.Client`.
    scene : XML file.
    frames : to render, in this order.
    variant : variant of this process, which workers set too.
    sensor, preview, threads : as in `cluster.render`.
    keep : folder of sums that wait for their picture.
    """

    def __init__(
        self,
        client: Any,
        scene: Path,
        frames: Sequence[FrameRequest],
        variant: str,
        *,
        keep: Path,
        sensor: int = 0,
        preview: bool = False,
        threads: int = 0,
    ) -> None:
        check_workers(client, variant)
        self.report = Report()
        self._client, self._kept = client, Kept(keep)
        self.scene = load_scene(scene, frames[0].values)
        self.sensor = sensor_of(self.scene, sensor, preview)
        default_samples = preview_samples(self.sensor, preview)
        film = film_of(self.scene, self.sensor)
        self.frames: list[Task] = []
        for number, frame in enumerate(frames):
            files = SceneFiles.from_scene(scene, frame.values)
            passes = passes_of(self.sensor, frame.spp or default_samples, frame.seed)
            self.frames.append(
                Task(files, variant, sensor, preview, film, number, Span(0, len(passes)),
                     tuple(passes), threads)
            )  # fmt: skip
        self.needed = BYTES_A_PROCESS + self._bytes_of_films()
        warn_of_memory(client, self.needed)

    def _bytes_of_films(self) -> float:
        """Estimate the memory of a pass, and of the sums that a worker holds."""
        film = self.sensor.film()
        channels = film.prepare(integrator_of(self.scene).aov_names())
        sums = sums_in_worker(sum(frame.span.count for frame in self.frames), len(self.frames))
        largest = max(each.spp for frame in self.frames for each in frame.passes)
        pixels = int(np.prod(film.crop_size()))
        return pixels * (BYTES_A_SAMPLE * largest + 4.0 * channels * sums)

    def render(self, stop: Stop, progress: Progress) -> Iterator[Result]:
        """Yield frame after frame; end early once asked to stop.

        The stored sums of a frame are removed when the next is asked for: its picture is written.

        Raises a DiffractionError that names frame, passes and worker, if a task fails; finished
        work is stored.
        """
        start = time.perf_counter()
        groups = Groups(self._client, self._kept, self.frames, self.report, stop, progress)
        try:
            for frame in self.frames:
                total = added(frame.span, partial(groups.sum_of, frame))
                spp = sum(each.spp for each in frame.passes)
                picture = developed(self.scene, self.sensor, total.raw, spp)
                self.report.where.update(total.where)
                yield Result(picture, spp, stop.asked)
                self._kept.forget(frame)
                if stop.asked:
                    return
        except Stopped:
            return
        finally:
            groups.under_way.cancel()
            self.report.lost = groups.under_way.lost()
            self.report.seconds = time.perf_counter() - start
            if len(self.report.where) > 1:
                warn(
                    "sums of different processors or numbers of threads were mixed, and may "
                    f"differ in their last bits: {'; '.join(sorted(self.report.where))}"
                )
