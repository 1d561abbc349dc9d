"""Calls on workers: given out again where files or the scheduler were lost."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any, Generic, TypeVar

from ..errors import DiffractionError
from ..extras import optional
from ..scene.passes import Stop
from . import workers
from .tasks import Failed, MissingFiles, SceneFiles, called, versions

Key = TypeVar("Key")
#: Contents of files that a worker lacks, by digest: futures, which Dask replaces by their results.
Contents = Mapping[str, Any]
#: Submits a call with the contents, and returns its futures; the result is that of the last.
Give = Callable[[Contents], list[Any]]


class UnderWay(Generic[Key]):
    """Calls that workers are at, by keys of the caller.

    Parameters
    ----------
    client : `distributed.Client`.
    costs : whose `retries` counts the calls that were given out again.
    stop : asked, it ends the wait for a scheduler that was lost.
    """

    def __init__(self, client: Any, costs: Any, stop: Stop | None = None) -> None:
        self._client, self._costs, self._stop = client, costs, stop
        self._calls: dict[Key, tuple[list[Any], Give, SceneFiles | None]] = {}
        self._contents: dict[str, Any] = {}

    def __len__(self) -> int:
        """Return the number of futures."""
        return sum(len(futures) for futures, *_ in self._calls.values())

    def give_out(self, key: Key, give: Give, files: SceneFiles | None = None) -> None:
        """Give out a call; files : that it may need."""
        self._calls[key] = give({}), give, files

    def finished(self) -> Iterator[tuple[Key, Any]]:
        """Yield the keys and the results of calls that are done, without waiting; or `Failed`.

        Raises a DiffractionError if the scheduler is gone, and does not come back.
        """
        done = [(key, call) for key, call in self._calls.items() if call[0][-1].done()]
        for key, (futures, give, files) in done:
            answer, contents = outcome(futures[-1]), {}
            if isinstance(answer, MissingFiles) and files is not None:
                contents = {digest: self._content(files, digest) for digest in answer.digests}
            elif answer is not None:
                del self._calls[key]
                yield key, answer
                continue
            else:
                self._contents.clear()
                self._wait_for_scheduler()
            self._costs.retries += 1
            self._calls[key] = give(contents), give, files

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

    def _wait_for_scheduler(self) -> None:
        end = time.monotonic() + workers.PATIENCE
        while self._client.status != "running" and not (self._stop and self._stop.asked):
            if self._client.status == "closed" or time.monotonic() > end:
                raise DiffractionError(
                    "the scheduler is gone; start it and its workers, and run the same command "
                    "again, which goes on from the stored results"
                )
            time.sleep(0.1)


def submitted(client: Any, work: Callable[..., Any], *given: Any, priority: int = 0) -> Any:
    """Return the future of a call on a worker of the versions here, whose errors are `Failed`."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sending large graph")  # it is sent once
        return client.submit(called, versions(), work, *given, pure=False, priority=priority)


def outcome(future: Any) -> Any:
    """Return the result of a task, or its error: `MissingFiles`, or `Failed`, also if its workers
    died. None if the scheduler lost it."""
    distributed = optional("distributed")
    try:
        return future.result()
    except (Failed, MissingFiles) as error:
        return error
    except distributed.scheduler.KilledWorker as error:
        reason = "it died, as did those before that had the same task; a worker may lack memory"
        return Failed(f"{reason}, see docs/cluster.md", error.last_worker.address)
    except (CancelledError, distributed.client.FutureCancelledError, OSError):
        return None
