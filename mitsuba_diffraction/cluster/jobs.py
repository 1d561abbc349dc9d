"""Independent jobs on workers: scans and gratings as they finish, windows in order."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from functools import partial
from typing import Any

from ..errors import DiffractionError
from ..heights import HeightField
from ..progress import Progress
from ..settings import TableSettings
from ..tables import DiffractionTable
from ..tables.build.build import build_with
from .calls import Contents, Report, UnderWay, submitted
from .tasks import Failed
from .workers import check_workers

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
    return build_with(heights, TableSettings(**settings), progress, WorkerCalls(client))


class WorkerCalls:
    """Independent calls on workers: as they finish, or in order.

    Raises a DiffractionError if a worker is of no use.

    Parameters
    ----------
    client : `distributed.Client`.
    variant : of Mitsuba that workers have to work in; None where that does not matter.

    Attributes
    ----------
    workers : number at the start.
    report : its tasks, retries, and seconds of work.
    """

    def __init__(self, client: Any, variant: str | None = None) -> None:
        self._client, self.workers = client, len(check_workers(client, variant))
        self.report = Report()

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
        self, work: Callable[[Any], Any], arguments: Iterable[Any], early: Sized = ()
    ) -> Iterator[tuple[int, Any]]:
        """Yield results as `answers` does, and raise a DiffractionError if a call fails, too."""
        for n, result in self.answers(work, arguments, early):
            if isinstance(result, Failed):
                raise DiffractionError(str(result))
            yield n, result

    def answers(
        self, work: Callable[..., Any], arguments: Iterable[Any], early: Sized = ()
    ) -> Iterator[tuple[int, Any]]:
        """Yield the number and the result of each call as it finishes.

        Raises a DiffractionError if the scheduler is gone, and does not come back.

        Parameters
        ----------
        work : called with an argument; with the argument and contents of files, once it has raised
            `MissingFiles`.
        arguments : have `files`, `SceneFiles`, if the work needs files.
        early : results that wait for others.

        Returns
        -------
        Numbers and results; `Failed` for an error, or a worker that died of a call again and again.
        """
        left = enumerate(arguments)
        calls = UnderWay[int](self._client, self.report)
        try:
            while True:
                room = _AHEAD * max(1, calls.workers()) - len(calls) - len(early)
                for n, argument in itertools.islice(left, max(0, room)):
                    give = partial(self._submitted, work, argument)
                    calls.give_out(n, give, getattr(argument, "files", None))
                if not calls:
                    return
                for n, answer in calls.finished():
                    if isinstance(answer, Failed):
                        yield n, answer
                        continue
                    result, seconds = answer
                    self.report.tasks += 1
                    self.report.busy += seconds
                    yield n, result
        finally:
            calls.cancel()

    def _submitted(self, work: Callable[..., Any], argument: Any, contents: Contents) -> list[Any]:
        given = (argument, contents) if contents else (argument,)
        return [submitted(self._client, _timed, work, *given)]


def _timed(work: Callable[..., Any], *given: Any) -> tuple[Any, float]:
    """Return the result of a call, and its seconds."""
    start = time.perf_counter()
    return work(*given), time.perf_counter() - start
