"""Independent jobs, here or on workers: scans as they finish, windows in order."""

from __future__ import annotations

import itertools
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
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

_POLL = 0.005  # seconds
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
) -> tuple[DiffractionTable, WorkerCalls]:
    """Build as `build`, and return the table with the jobs that know their cost."""
    scans = [heights] if isinstance(heights, HeightField) else list(heights)
    if resolved(settings, scans).taper_width is None:
        raise DiffractionError(
            "workers build tables of windows: give a scan (periodic=open), or windows=W, or do "
            "without workers"
        )
    check_workers(client, None)
    run = WorkerCalls(client)
    return build_with(heights, settings, progress, run), run


class WorkerCalls:
    """Independent calls on workers, or here: as they finish, or in order.

    Parameters
    ----------
    client : `distributed.Client`, or None to do all here.

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
        """Yield results in the order of the arguments, a few of which are at work at once.

        Raises a DiffractionError that names the worker, if one fails; or if the scheduler is gone.
        """
        wanted, early = 0, dict[int, Any]()
        for n, result in self.finished(work, arguments, early):
            early[n] = result
            while wanted in early:
                yield early.pop(wanted)
                wanted += 1

    def finished(
        self, work: Callable[[Any], Any], arguments: Iterable[Any], early: Sized | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Yield results as `answers` does, and raise a DiffractionError if a call fails, too."""
        for n, result in self.answers(work, arguments, early):
            if isinstance(result, Failed):
                raise DiffractionError(str(result))
            yield n, result

    def answers(
        self, work: Callable[..., Any], arguments: Iterable[Any], early: Sized | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Yield the number and the result of each call as it finishes.

        Raises a DiffractionError if the scheduler is gone, and does not come back.

        Parameters
        ----------
        work : called with an argument; with the argument and contents of files, once it has raised
            `MissingFiles`.
        arguments : have `files`, `SceneFiles`, if the work needs files.
        early : results that wait for others; None gives out all calls at once.

        Returns
        -------
        Numbers and results; `Failed` for an error, or a worker that died of a call again and again.
        """
        left = enumerate(arguments)
        if self._client is None:
            yield from ((n, work(argument)) for n, argument in left)
            return
        waiting: dict[Any, tuple[int, Any]] = {}
        try:
            while True:
                room = None
                if early is not None:
                    room = _AHEAD * max(1, len(workers_of(self._client)))
                    room = max(0, room - len(waiting) - len(early))
                for n, argument in itertools.islice(left, room):
                    waiting[self._submitted(work, argument)] = n, argument
                if not waiting:
                    return
                while not (done := [future for future in waiting if future.done()]):
                    time.sleep(_POLL)
                for future in done:
                    (n, argument), answer = waiting.pop(future), outcome(future)
                    if isinstance(answer, Failed):
                        yield n, answer
                    elif isinstance(answer, MissingFiles):
                        files, wanted = argument.files.files, set(answer.digests)
                        contents = {d: Path(path).read_bytes() for path, d in files if d in wanted}
                        waiting[self._submitted(work, argument, contents)] = n, argument
                    elif answer is None:
                        wait_for_scheduler(self._client)
                        self.retries += 1
                        waiting[self._submitted(work, argument)] = n, argument
                    else:
                        result, seconds = answer
                        self.tasks += 1
                        self.busy += seconds
                        yield n, result
        finally:
            for future in waiting:
                future.cancel()

    def _submitted(self, *call: Any) -> Any:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
            return self._client.submit(_done, versions(), *call, pure=False)


def _done(wanted: tuple[str, ...], work: Callable[..., Any], *given: Any) -> tuple[Any, float]:
    """Return the result of a call, and its seconds."""
    start = time.perf_counter()
    with failures():
        check_versions(wanted)  # a late worker has not been checked
        return work(*given), time.perf_counter() - start
