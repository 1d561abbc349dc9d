"""Independent jobs, one by one here or on workers, in whatever order they are done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any, Protocol

from ..errors import one_line
from ..scene.passes import Stop
from .files import SceneFiles
from .tasks import Failed, Lacking
from .workers import require_dask

_POLL = 0.02  # seconds


class HasFiles(Protocol):
    """A job that needs files."""

    @property
    def files(self) -> SceneFiles:
        """These, by content."""


def each(
    client: Any, work: Callable[..., Any], jobs: Sequence[HasFiles], stop: Stop
) -> Iterator[tuple[int, Any]]:
    """Do `work(job, contents)` for each, and give its number with what came of it.

    Parameters
    ----------
    client : `distributed.Client`, or None to do all here.
    work : gives `Lacking` for files that it needs by content.
    jobs : any.
    stop : asked, it ends what has not begun.

    Returns
    -------
    Numbers and results; `Failed` where a worker died of a job, again and again.
    """
    if client is None:
        for n, job in enumerate(jobs):
            if stop.asked:
                return
            yield n, work(job)
        return
    waiting = {client.submit(work, job, pure=False): n for n, job in enumerate(jobs)}
    try:
        while waiting and not stop.asked:
            for future in [future for future in waiting if future.done()]:
                n = waiting.pop(future)
                found = _result(future)
                if isinstance(found, Lacking):
                    again = client.submit(work, jobs[n], _contents(jobs[n], found), pure=False)
                    waiting[again] = n
                else:
                    yield n, found
            time.sleep(_POLL)
    finally:
        for future in waiting:
            future.cancel()


def _result(future: Any) -> Any:
    distributed = require_dask()
    try:
        return future.result()
    except distributed.scheduler.KilledWorker as error:
        return Failed("its worker died, as did others with it", error.last_worker.address)
    except (CancelledError, OSError) as error:
        return Failed(f"it was lost with the scheduler ({one_line(str(error))[:80]})", "")


def _contents(job: HasFiles, lacking: Lacking) -> Mapping[str, bytes]:
    wanted = set(lacking.digests)
    return {d: Path(path).read_bytes() for path, d in job.files.files if d in wanted}
