"""Calls on workers: given out again where files or the scheduler were lost."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..errors import DiffractionError
from ..extras import optional
from . import workers
from .tasks import Failed, MissingFiles, SceneFiles, Sums, called, versions
from .workers import workers_of

#: Seconds between counts of the workers.
COUNT_EVERY = 2.0
_POLL = 0.01  # seconds

Key = TypeVar("Key")
#: Contents of files that a worker lacks, by digest: futures, which Dask replaces by their results.
Contents = Mapping[str, Any]
#: Submits a call with the contents, and returns its futures; the result is that of the last.
Give = Callable[[Contents], list[Any]]


@dataclass
class Report:
    """Cost of a run on workers."""

    tasks: int = 0  # that workers did
    groups: int = 0  # sums of passes that came from workers
    kept: int = 0  # sums that had been stored by an earlier run
    # groups or calls that were given out again, since the scheduler or a worker's files were lost;
    # tasks of a worker that died are given to others by the scheduler
    retries: int = 0
    lost: int = 0  # workers that have left
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

    def add(self, sums: Sums) -> None:
        """Count a sum that came from workers."""
        self.groups += 1
        self.tasks += sums.tasks
        self.busy += sums.seconds
        self.bytes += sums.raw.nbytes
        self.peak = max(self.peak, sums.peak)
        self.workers.update(sums.workers)


class UnderWay(Generic[Key]):
    """Calls that workers are at, by keys of the caller; and the number of workers.

    Parameters
    ----------
    client : `distributed.Client`.
    report : counts the calls that were given out again.
    """

    def __init__(self, client: Any, report: Report) -> None:
        self._client, self._report, self._silent_since = client, report, 0.0
        self._calls: dict[Key, tuple[list[Any], Give, SceneFiles | None]] = {}
        self._contents: dict[str, Any] = {}
        self._seen = set[str]()
        self.lost()

    def __len__(self) -> int:
        """Return the number of futures."""
        return sum(len(futures) for futures, *_ in self._calls.values())

    def workers(self) -> int:
        """Return the number of workers, counted every `COUNT_EVERY` seconds."""
        if time.monotonic() - self._counted > COUNT_EVERY:
            self.lost()
        return len(self._there)

    def lost(self) -> int:
        """Count the workers, and return the number of workers that have left."""
        self._counted, self._there = time.monotonic(), set(workers_of(self._client))
        self._seen |= self._there
        return len(self._seen - self._there)

    def give_out(self, key: Key, give: Give, files: SceneFiles | None = None) -> None:
        """Give out a call; files : that it may need."""
        self._calls[key] = give({}), give, files

    def finished(self) -> Iterator[tuple[Key, Any]]:
        """Yield the keys and the results of calls that are done; wait a moment if none is.

        A result is `Failed` after an error, or if workers died of a call again and again.

        Raises a DiffractionError if the scheduler is gone, and does not come back.
        """
        distributed = optional("distributed")
        done = [(key, call) for key, call in self._calls.items() if call[0][-1].done()]
        if not done or self._silent_since:
            time.sleep(_POLL)
        for key, (futures, give, files) in done:
            answer, contents = None, {}
            try:
                answer = futures[-1].result()
            except Failed as error:
                answer = error
            except distributed.scheduler.KilledWorker as error:
                reason = "it died, as did those before that had the same task; a worker may lack"
                answer = Failed(f"{reason} memory, see docs/cluster.md", error.last_worker.address)
            except MissingFiles as error:
                assert files is not None
                contents = {digest: self._content(files, digest) for digest in error.digests}
            except (CancelledError, OSError):
                if not self._scheduler_answers():
                    return  # asked again later
            if answer is None:
                self._report.retries += 1
                self._calls[key] = give(contents), give, files
            else:
                del self._calls[key]
                yield key, answer

    def cancel(self) -> None:
        """Cancel the calls, whose results nobody waits for."""
        self._client.cancel([future for futures, *_ in self._calls.values() for future in futures])
        self._calls.clear()

    def _content(self, files: SceneFiles, digest: str) -> Any:
        """Return the content of a file as a task, which Dask repeats where its result is lost."""
        if digest not in self._contents:
            path = next(path for path, other in files.files if other == digest)
            self._contents[digest] = self._client.submit(
                bytes, Path(path).read_bytes(), key=f"file-{digest[:32]}"
            )
        return self._contents[digest]

    def _scheduler_answers(self) -> bool:
        """Return whether the scheduler, which has lost a call, answers again."""
        self._contents.clear()
        now = time.monotonic()
        self._silent_since = self._silent_since or now
        if self._client.status == "running":
            self._silent_since = 0.0
        elif self._client.status == "closed" or now > self._silent_since + workers.PATIENCE:
            raise DiffractionError(
                "the scheduler is gone; start it and its workers, and run the same command again, "
                "which goes on from the stored results"
            )
        return not self._silent_since


def submitted(client: Any, work: Callable[..., Any], *given: Any, priority: int = 0) -> Any:
    """Return the future of a call on a worker of the versions here, whose errors are `Failed`."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
        return client.submit(called, versions(), work, *given, pure=False, priority=priority)
