"""Independent jobs, here or on workers: scans as they finish, windows in order."""

from __future__ import annotations

import itertools
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..errors import DiffractionError
from ..heights import HeightField
from ..heights.coherence import resolved
from ..progress import Progress
from ..settings import TableSettings
from ..tables import DiffractionTable
from ..tables.build.build import build_with
from .tasks import Failed, MissingFiles, check_versions, failures, versions
from .workers import check_workers, outcome, wait_for_scheduler, workers_of

_POLL = 0.02  # seconds
#: Arguments that are with the scheduler for every worker: one is worked at, the other is there.
_AHEAD = 2


def build(
    heights: HeightField | Sequence[HeightField],
    *,
    client: Any,
    progress: Progress | None = None,
    **settings: Any,
) -> DiffractionTable:
    """Build the table of a wide scan on the workers of a Dask cluster.

    Workers are sent some windows at a time, and send sums of their powers back, which the client
    adds up in the order of the windows: the table equals `DiffractionTable.build`, to the last
    bit, on such a processor, with any number of workers.

    Raises a DiffractionError if the heights tile the plane, without windows, a worker is of no use,
    or the table cannot be built.

    Parameters
    ----------
    heights : one scan or several.
    client : `distributed.Client`; workers have one Dask thread each (`cluster.connect`).
    progress : called as progress(done, total, text).
    settings : of `DiffractionTable.build`.
    """
    return build_on_workers(heights, TableSettings(**settings), client, progress)[0]


def build_on_workers(
    heights: HeightField | Sequence[HeightField],
    settings: TableSettings,
    client: Any,
    progress: Progress | None = None,
) -> tuple[DiffractionTable, OrderedMap]:
    """Build as `build`, and return the table with the map that knows its cost."""
    scans = [heights] if isinstance(heights, HeightField) else list(heights)
    if resolved(settings, scans).taper_width is None:
        raise DiffractionError(
            "workers build tables of windows: give a scan (periodic=open), or windows=W, or do "
            "without workers"
        )
    check_workers(client, None)
    run = OrderedMap(client)
    return build_with(heights, settings, progress, run), run


def run_jobs(
    client: Any, work: Callable[..., Any], jobs: Sequence[Any]
) -> Iterator[tuple[int, Any]]:
    """Do `work(job, contents)` for each job, and yield its number and result.

    Raises a DiffractionError if the scheduler is gone, and does not come back.

    Parameters
    ----------
    client : `distributed.Client`, or None to do all here.
    work : raises `MissingFiles` for files that it needs by content.
    jobs : have `files`, `SceneFiles` that are known by content.

    Returns
    -------
    Numbers and results; `Failed` where a worker died of a job, again and again.
    """
    if client is None:
        for n, job in enumerate(jobs):
            yield n, work(job)
        return
    waiting = {client.submit(work, job, pure=False): n for n, job in enumerate(jobs)}
    try:
        while waiting:
            for future in [future for future in waiting if future.done()]:
                n, result = waiting.pop(future), outcome(future)
                if result is None:
                    wait_for_scheduler(client)
                    waiting[client.submit(work, jobs[n], pure=False)] = n
                elif isinstance(result, MissingFiles):
                    files, wanted = jobs[n].files.files, set(result.digests)
                    contents = {d: Path(path).read_bytes() for path, d in files if d in wanted}
                    waiting[client.submit(work, jobs[n], contents, pure=False)] = n
                else:
                    yield n, result
            time.sleep(_POLL)
    finally:
        for future in waiting:
            future.cancel()


class OrderedMap:
    """`map` on workers: results in the order of the arguments, a few of which are at work at once.

    Attributes
    ----------
    tasks, retries : that were done, and given out again when the scheduler was lost.
    busy : seconds of all workers' work.
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self.tasks = self.retries = 0
        self.busy = 0.0

    def summary(self) -> dict[str, Any]:
        """Return the cost as plain data."""
        return {name: getattr(self, name) for name in ("tasks", "retries", "busy")}

    def __call__(self, work: Callable[[Any], Any], arguments: Iterable[Any]) -> Iterator[Any]:
        """Yield the results of `work` for each of the arguments.

        Raises a DiffractionError that names the worker, if one fails; or if the scheduler is gone.
        """
        waiting: deque[tuple[Any, Any]] = deque()
        left = iter(arguments)
        try:
            while True:
                room = _AHEAD * max(1, len(workers_of(self._client))) - len(waiting)
                for argument in itertools.islice(left, max(0, room)):
                    waiting.append(((work, argument), self._submitted((work, argument))))
                if not waiting:
                    return
                yield self._result(waiting)
        finally:
            for _, future in waiting:
                future.cancel()

    def _result(self, waiting: deque[tuple[Any, Any]]) -> Any:
        while (answer := outcome(waiting[0][1])) is None:
            wait_for_scheduler(self._client)
            self.retries += len(waiting)
            for n, (call, _) in enumerate(waiting):
                waiting[n] = call, self._submitted(call)
        if isinstance(answer, Failed):
            raise DiffractionError(str(answer))
        waiting.popleft()
        result, seconds = answer
        self.tasks += 1
        self.busy += seconds
        return result

    def _submitted(self, call: tuple[Any, Any]) -> Any:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
            return self._client.submit(_done, versions(), *call, pure=False)


def _done(wanted: tuple[str, ...], work: Callable[[Any], Any], argument: Any) -> tuple[Any, float]:
    """Return the result of a call, and its seconds."""
    start = time.perf_counter()
    with failures():
        check_versions(wanted)  # a late worker has not been checked
        return work(argument), time.perf_counter() - start
