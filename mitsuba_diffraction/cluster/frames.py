"""Frames rendered by tasks on workers: submitted, stored on disk, added up in order, developed."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DiffractionError, one_line, warn
from ..progress import Progress, silent
from ..scene.load import load_scene, preview_samples, sensor_of, set_variant, shrink
from ..scene.passes import Result, Stop, developed, groups_of, passes_of
from ..tables.store import Record, read_record, write_record
from .tasks import Failed, SceneFiles, Sums, Task, film_of, run_task, versions
from .workers import check_workers, memory_warnings, outcome, wait_for_scheduler, workers_of

#: Tasks that are with the scheduler for every worker: one is worked at, others wait.
AHEAD = 3
#: Sums that wait for their turn in memory, too; others are read from the disk again.
HELD = 16
#: Bytes that Dr.Jit takes for a sample of a pass, and for the rest of a process: estimates.
BYTES_A_SAMPLE, BYTES_A_PROCESS = 400, 5e8
#: Seconds between two counts of the workers.
COUNT_INTERVAL = 2.0
_POLL = 0.02  # seconds


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

    Tasks are the groups of passes that one process renders, added up in the order of their seeds.
    With `threads=1` the picture is, bit for bit, that of one process with one Dr.Jit thread on the
    same kind of processor. With several threads, passes agree within 1e-6 of the film's largest
    value: threads add samples to a pixel in the order in which they finish (`scene.passes`).

    Parameters
    ----------
    scene : XML file.
    client : `distributed.Client`; workers have one Dask thread each (`cluster.connect`).
    parameters : of the scene, as -D sets them.
    spp : samples per pixel; by default the scene's.
    seed : whole number from 0.
    variant : of Mitsuba; by default as `render` chooses it here.
    sensor : its number.
    preview : half the width and height, and at most 16 samples unless `spp` is given.
    threads : of Dr.Jit in every worker; 0 for one a core.
    keep : folder where finished passes wait for the picture, and where a later call with the same
        arguments finds them; by default a temporary one.
    progress : called as progress(tasks done, tasks in all, text).

    Returns
    -------
    `scene.passes.Result`, with the picture as a `mi.Bitmap`.

    Raises
    ------
    DiffractionError
        If a worker is of no use, or a task fails: with frame, passes and worker.
    """
    name = set_variant(variant)
    with tempfile.TemporaryDirectory() as temporary, Stop() as stop:
        film = Film(
            client, Path(scene), [FrameRequest(dict(parameters or {}), spp, seed)], name,
            keep=Path(keep or Path(temporary) / "passes"), warn=warn, sensor=sensor,
            preview=preview, threads=threads,
        )  # fmt: skip
        for result in film.render(stop, progress):
            film.forget(0)
            return result
    raise DiffractionError("interrupted: finished passes are kept where `keep` says")


@dataclass
class Report:
    """Cost of a run on workers."""

    tasks: int = 0  # that were done now
    kept: int = 0  # that had been kept
    # tasks that were given out again, since the scheduler or a worker's files were lost; those of
    # a worker that died are given to others by the scheduler
    retries: int = 0
    lost: int = 0  # workers that were there and are not any more
    seconds: float = 0.0  # wall time of the client
    busy: float = 0.0  # seconds of all workers' work
    bytes: int = 0  # size of the sums that came from workers
    peak: int = 0  # bytes of memory that a worker has taken at most
    # workers, where: addresses, and processors with threads, of what has been added up
    workers: set[str] = field(default_factory=set)
    where: set[str] = field(default_factory=set)

    def summary(self) -> dict[str, Any]:
        """Return plain data, with the time that a task costs besides its work."""
        plain = {k: sorted(v) if isinstance(v, set) else v for k, v in vars(self).items()}
        count = len(self.workers) or 1
        idle = self.seconds * count - self.busy
        return plain | {"overhead_per_task_s": idle / self.tasks if self.tasks else 0.0}

    def add(self, sums: Sums, new: bool) -> None:
        """Count one sum. new: rendered in this run."""
        self.where.add(sums.where)
        if not new:
            self.kept += 1
            return
        self.tasks += 1
        self.busy += sums.seconds
        self.bytes += sums.raw.nbytes
        self.peak = max(self.peak, sums.peak)
        self.workers.add(sums.worker)


@dataclass(frozen=True)
class FrameRequest:
    """Request for a frame: values of the scene's parameters, samples (None: the scene's), seed."""

    values: Mapping[str, str]
    spp: int | None
    seed: int


class Film:
    """Frames of one scene, from workers.

    Parameters
    ----------
    client : `distributed.Client`.
    scene : XML file.
    frames : to render, in this order.
    variant : that is set here; workers set it, too.
    sensor, preview, threads : as in `cluster.render`.
    keep : folder of sums that wait for their picture.
    warn : called with lines that are worth one.

    Raises
    ------
    DiffractionError
        If the scene cannot be loaded, or a worker is of no use.
    """

    def __init__(
        self,
        client: Any,
        scene: Path,
        frames: Sequence[FrameRequest],
        variant: str,
        *,
        keep: Path,
        warn: Callable[[str], None],
        sensor: int = 0,
        preview: bool = False,
        threads: int = 0,
    ) -> None:
        self._seen = set(check_workers(client, variant))
        self.report = Report()
        self._client, self._kept, self._warn = client, Kept(keep, warn), warn
        self._scene = load_scene(scene, frames[0].values)
        self._sensor = sensor_of(self._scene, sensor)
        default_samples = preview_samples(self._sensor, preview)
        if preview:
            shrink(self._sensor)
        film = film_of(self._scene, self._sensor)
        self._frames: list[list[Task]] = []
        for number, frame in enumerate(frames):
            files, first, tasks = SceneFiles.from_scene(scene, frame.values), 0, []
            for group in groups_of(
                passes_of(self._sensor, frame.spp or default_samples, frame.seed, variant)
            ):
                tasks.append(
                    Task(files, variant, sensor, preview, film, number, first, tuple(group),
                         versions(), threads)
                )  # fmt: skip
                first += len(group)
            self._frames.append(tasks)
        pixels = int(np.prod(self._sensor.film().crop_size()))
        largest = max(one.spp for tasks in self._frames for task in tasks for one in task.passes)
        self.needed = BYTES_A_PROCESS + BYTES_A_SAMPLE * pixels * largest
        for line in memory_warnings(client, self.needed):
            warn(line)

    @property
    def sensor(self) -> Any:
        """Sensor of frame 0, with its film."""
        return self._sensor

    @property
    def scene(self) -> Any:
        """Scene of frame 0."""
        return self._scene

    def render(self, stop: Stop, progress: Progress) -> Iterator[Result]:
        """Yield frame after frame; end early once asked to stop.

        Raises
        ------
        DiffractionError
            Naming frame, passes and worker, if a task fails; what is done is kept.
        """
        start = time.perf_counter()
        sums = _InOrder(self, stop, progress)
        try:
            for tasks in self._frames:
                total: Any = 0.0
                for task in tasks:
                    sum_of_task = sums.wait_for(task)
                    if sum_of_task is None:
                        return
                    total = total + sum_of_task.raw
                spp = sum(one.spp for task in tasks for one in task.passes)
                picture = developed(self._scene, self._sensor, total, spp)
                self.report.seconds = time.perf_counter() - start
                yield Result(picture, spp, stop.asked)
                if stop.asked:
                    return
        finally:
            sums.cancel()
            self._count_workers()
            self.report.seconds = time.perf_counter() - start
            if len(self.report.where) > 1:
                self._warn(
                    "sums of different processors or numbers of threads were mixed, and may "
                    f"differ in their last bits: {'; '.join(sorted(self.report.where))}"
                )

    def _count_workers(self) -> int:
        there = set(workers_of(self._client))
        self._seen |= there
        self.report.lost = len(self._seen - there)
        return len(there)

    def forget(self, frame: int) -> None:
        """Remove the stored sums of a frame."""
        for task in self._frames[frame]:
            self._kept.forget(task)


class _InOrder:
    """Submits tasks ahead of the sum that is due, and collects results as they come."""

    def __init__(self, film: Film, stop: Stop, progress: Progress) -> None:
        self._film, self._stop, self._progress = film, stop, progress
        self._waiting = [task for tasks in film._frames for task in tasks][::-1]
        self._total = len(self._waiting)
        self._with: dict[Any, Task] = {}
        self._ready: dict[str, Sums | None] = {}  # by key; None for those that are only on disk
        self._done = 0
        self._contents: dict[str, Any] = {}
        self._counted = (-math.inf, 1)

    def wait_for(self, task: Task) -> Sums | None:
        """Return the sums of a task; None once asked to stop."""
        kept = self._film._kept
        while True:
            if task.key in self._ready or task in kept:
                new = task.key in self._ready
                result = self._ready.pop(task.key, None) or kept.read(task)
                if result is not None:
                    self._film.report.add(result, new)
                    return result
                if task not in self._with.values() and task not in self._waiting:
                    self._waiting.append(task)  # it was damaged
            if self._stop.asked:
                return None
            self._give_out()
            self._take()
            self._tell(task)
            time.sleep(_POLL)

    def cancel(self) -> None:
        """Cancel tasks whose results nobody waits for."""
        for future in self._with:
            future.cancel()
        self._with.clear()

    def _give_out(self) -> None:
        kept = self._film._kept
        most = AHEAD * max(1, self._workers())
        while self._waiting and len(self._with) < most:
            task = self._waiting.pop()
            if task in kept:
                self._done += 1
            else:
                self._with[self._submitted(task)] = task

    def _submitted(self, task: Task, lacking: Sequence[str] = ()) -> Any:
        client = self._film._client
        for digest in lacking:
            if digest not in self._contents:
                (path,) = {p for p, d in task.files.files if d == digest} or {""}
                # a task of its own, which Dask repeats where its result is lost
                self._contents[digest] = client.submit(
                    bytes, Path(path).read_bytes(), key=f"file-{digest[:32]}"
                )
        contents = {digest: self._contents[digest] for digest in lacking}
        return client.submit(run_task, task, contents, pure=False, priority=-task.frame, key=None)

    def _take(self) -> None:
        report = self._film.report
        for future in [future for future in self._with if future.done()]:
            task = self._with.pop(future)
            answer = outcome(future)
            if answer is None:
                self._contents.clear()
                wait_for_scheduler(self._film._client, self._stop)
            if isinstance(answer, Sums):
                on_disk = self._film._kept.write(task, answer)
                held = sum(sums is not None for sums in self._ready.values())
                self._ready[task.key] = None if on_disk and held >= HELD else answer
                self._done += 1
            elif isinstance(answer, Failed):
                raise DiffractionError(f"{task}, worker {answer.worker}: {answer.text}")
            else:
                report.retries += 1
                self._with[self._submitted(task, answer.digests if answer else ())] = task

    def _tell(self, task: Task) -> None:
        frames = len(self._film._frames)
        what = f"frame {task.frame + 1} of {frames}, " if frames > 1 else ""
        self._progress(self._done, self._total, f"{what}{self._workers()} workers")

    def _workers(self) -> int:
        """Return the number of workers, counted every other second."""
        now = time.perf_counter()
        if now - self._counted[0] > COUNT_INTERVAL:
            self._counted = now, self._film._count_workers()
        return int(self._counted[1])


class Kept:
    """Folder of sums on disk, made when the first comes and removed when it is empty.

    Parameters
    ----------
    folder : where the files lie, one for each task.
    warn : called with a line for each damaged file.
    """

    def __init__(self, folder: Path, warn: Callable[[str], None] = warn) -> None:
        self.folder, self._warn = folder, warn

    def __contains__(self, task: Task) -> bool:
        return self._file(task).is_file()

    def write(self, task: Task, sums: Sums) -> bool:
        """Write a sum whole, and say whether it was: one that is not finite is never kept."""
        if not np.isfinite(sums.raw).all():
            return False
        self.folder.mkdir(parents=True, exist_ok=True)
        about = {k: v for k, v in asdict(sums).items() if k != "raw"}
        write_record(self._file(task), _title(task), Record(about, [sums.raw]))
        return True

    def read(self, task: Task) -> Sums | None:
        """Read a sum; None if there is none, or if it is damaged, which is removed."""
        try:
            record = read_record(self._file(task), _title(task))
            return Sums(raw=record.arrays[0], **record.document)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, LookupError, TypeError, MemoryError, RecursionError) as error:
            self._warn(
                f"'{self._file(task)}' is damaged ({one_line(str(error))[:100]}) and rendered again"
            )
            self._file(task).unlink(missing_ok=True)
            return None

    def forget(self, task: Task) -> None:
        """Remove a sum whose picture is written."""
        self._file(task).unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # others are in it
            self.folder.rmdir()

    def _file(self, task: Task) -> Path:
        return self.folder / f"{task.key[:32]}.sum"


def _title(task: Task) -> str:
    """Return the first line of a sum's file: its kind, and the key of its task."""
    return f"mitsuba_diffraction sum {task.key}"
