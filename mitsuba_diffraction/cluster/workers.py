"""Workers: started here, or of a running cluster; which of them can serve."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import threading
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from typing import Any

from ..errors import DiffractionError, one_line
from ..extras import optional
from ..scene import set_variant
from ..scene.passes import Stop
from .tasks import Failed, MissingFiles, check_versions, versions

#: Names a running cluster, as Dask has it.
VARIABLE = "DASK_SCHEDULER_ADDRESS"
#: Seconds for the first worker to come, and for a scheduler that was lost.
PATIENCE = 60.0
#: Seconds between counts of the workers.
COUNT_EVERY = 2.0
GONE = (
    "the scheduler is gone; start it and its workers, and run the same command again, which goes "
    "on from the stored results"
)


@contextlib.contextmanager
def connect(
    count: int | None = None,
    scheduler: str | None = None,
    *,
    patience: float = 10.0,
) -> Iterator[Any]:
    """Yield a `distributed.Client`: of `count` processes started here, or of a running cluster.

    Raises a DiffractionError if Dask is not installed, or nobody answers at the address.

    Parameters
    ----------
    count : processes, of one Dask thread each.
    scheduler : address, or the name of a scheduler file (.json); by default
        $DASK_SCHEDULER_ADDRESS.
    patience : seconds for the scheduler to answer.
    """
    distributed = optional("distributed")
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # ours are the words
    if count is not None:
        import dask

        settings = {
            # a worker that died is started again, and not given up if that takes more than 15 s
            "distributed.deploy.lost-worker-timeout": "10 minutes",
            # it looks at a worker's stack a hundred times a second, which costs 6 % of its time
            "distributed.worker.profile.enabled": False,
        }
        with dask.config.set(settings):
            # the processes that are started ignore Ctrl-C: it is for the client
            with _ctrl_c_ignored(), _silent_tracker():
                cluster = distributed.LocalCluster(
                    n_workers=count, threads_per_worker=1, processes=True, host="127.0.0.1",
                    dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
                )  # fmt: skip
            with cluster, distributed.Client(cluster) as client:
                client.register_plugin(_apart(distributed))
                yield client
        return
    address = scheduler or os.environ.get(VARIABLE)
    if not address:
        raise DiffractionError(
            f"there is no cluster: say how many workers to start, or name a scheduler "
            f"(or set {VARIABLE})"
        )
    named = {"scheduler_file" if address.endswith(".json") else "address": address}
    try:
        distributed.Client(**named, timeout=patience).close()
        # the same time is for a scheduler that is lost and comes back
        client = distributed.Client(**named, timeout=PATIENCE)
    except (OSError, ValueError, TypeError, TimeoutError) as error:  # TypeError: no certificate
        raise DiffractionError(
            f"no scheduler answers at '{address}' ({one_line(str(error))[:80]}); start one with "
            "'dask scheduler', and workers with 'dask worker --nthreads 1'"
        ) from error
    with client:
        yield client


def check_workers(client: Any, variant: str | None) -> list[str]:
    """Refuse workers that cannot serve, by name, and return the addresses of all.

    Raises a DiffractionError if there are none, or one has several Dask threads, other versions, or
    no LLVM or GPU.

    Parameters
    ----------
    client : `distributed.Client`.
    variant : of Mitsuba that they have to work in; None where that does not matter.
    """
    distributed = optional("distributed")
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except (TimeoutError, distributed.TimeoutError) as error:
        raise DiffractionError(
            f"no worker came within {PATIENCE:.0f} s; start some with 'dask worker --nthreads 1'"
        ) from error
    for address, about in workers_of(client).items():
        if about["nthreads"] != 1:
            raise DiffractionError(
                f"worker {address} has {about['nthreads']} Dask threads, of which Dr.Jit takes one "
                "at a time: start it with 'dask worker --nthreads 1'"
            )
    reasons = client.run(trouble_of_process, versions(), variant, on_error="return")
    answers = {a: trouble for a, trouble in reasons.items() if not isinstance(trouble, OSError)}
    for address, trouble in answers.items():  # the others have just gone
        if trouble is not None:
            raise DiffractionError(f"worker {address} is of no use: {one_line(str(trouble))}")
    return list(answers)


def workers_of(client: Any) -> dict[str, Any]:
    """Return the scheduler's description of its workers, by address; empty while it is gone."""
    if client.status != "running":  # it would be waited for
        return {}
    try:
        return dict(client.scheduler_info(n_workers=-1).get("workers", {}))
    except (OSError, CancelledError):
        return {}


class Headcount:
    """Number of workers, counted every `COUNT_EVERY` seconds.

    Parameters
    ----------
    client : `distributed.Client`.
    there : addresses of the workers at the start.
    """

    def __init__(self, client: Any, there: Iterable[str]) -> None:
        self._client, self._seen, self._there = client, set(there), set(there)
        self._time = time.monotonic()

    def now(self) -> int:
        """Return the number of workers."""
        if time.monotonic() - self._time > COUNT_EVERY:
            self.lost()
        return len(self._there)

    def lost(self) -> int:
        """Count now, and return how many workers were there and are not any more."""
        self._time, self._there = time.monotonic(), set(workers_of(self._client))
        self._seen |= self._there
        return len(self._seen - self._there)


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


def wait_for_scheduler(client: Any, stop: Stop | None = None) -> None:
    """Wait until the scheduler answers again, or `stop` is asked."""
    end = time.monotonic() + PATIENCE
    while client.status != "running" and not (stop and stop.asked):
        if client.status == "closed" or time.monotonic() > end:
            raise DiffractionError(GONE)
        time.sleep(0.1)


def memory_warnings(client: Any, needed: float) -> Iterator[str]:
    """Yield lines on workers whose memory limit is below the estimated need of a task, in bytes."""
    for address, about in workers_of(client).items():
        limit = about.get("memory_limit") or 0
        if 0 < limit < needed:
            yield (
                f"worker {address} may use {limit / 1e9:.2g} GB, and a task is estimated to need "
                f"{needed / 1e9:.2g} GB; start fewer workers, or smaller pictures"
            )


def trouble_of_process(wanted: tuple[str, ...], variant: str | None) -> str | None:
    """Return the reason why this process cannot serve, or None."""
    try:
        check_versions(wanted)
        if variant is not None:
            set_variant(variant)
    except DiffractionError as error:
        return str(error)
    return None


def _apart(distributed: Any) -> Any:
    """Return a plugin that takes workers out of the terminal's reach, late ones too.

    Mitsuba answers Ctrl-C itself while it renders, and a scalar variant leaves its pass unfinished.
    """

    class Apart(distributed.WorkerPlugin):
        def setup(self, worker: Any) -> None:
            with contextlib.suppress(OSError, AttributeError):  # leads one already; Windows
                os.setsid()

    return Apart()


@contextlib.contextmanager
def _silent_tracker() -> Iterator[None]:
    """Silence Python's tracker of semaphores, which starts inside, at a client's abrupt end."""
    name, before = "PYTHONWARNINGS", os.environ.get("PYTHONWARNINGS")
    line = "ignore:resource_tracker:UserWarning"
    os.environ[name] = f"{before},{line}" if before else line
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


@contextlib.contextmanager
def _ctrl_c_ignored() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
