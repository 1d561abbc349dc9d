"""Workers: started here, or of a running cluster; which of them can serve."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError
from typing import Any

from ..errors import DiffractionError, one_line, warn
from ..extras import optional
from ..scene import set_variant
from ..system import environment
from .tasks import called, versions

#: Names a running cluster, as Dask has it.
VARIABLE = "DASK_SCHEDULER_ADDRESS"
#: Seconds for the first worker to come, and for a scheduler that was lost.
PATIENCE = 60.0
# Text that a worker runs, twice, as it starts; one that leads its session is not in the way
_LEAVE = (
    "import contextlib, os\nwith contextlib.suppress(OSError, AttributeError):\n    os.setsid()"
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
            # Mitsuba answers Ctrl-C itself while it renders, and a scalar variant leaves its pass
            # unfinished: workers leave the terminal's reach, late ones too
            "distributed.worker.preload": [_LEAVE],
        }
        with dask.config.set(settings):
            # Python's tracker of semaphores, which starts inside, is silent at an abrupt end
            silent = f"{os.environ.get('PYTHONWARNINGS', '')},ignore:resource_tracker:UserWarning"
            # the processes that are started ignore Ctrl-C: it is for the client
            with _ctrl_c_ignored(), environment({"PYTHONWARNINGS": silent}):
                cluster = distributed.LocalCluster(
                    n_workers=count, threads_per_worker=1, processes=True, host="127.0.0.1",
                    dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
                )  # fmt: skip
            with cluster, distributed.Client(cluster) as client:
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
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise DiffractionError(
            f"no worker came within {PATIENCE:.0f} s; start some with 'dask worker --nthreads 1'"
        ) from error
    for address, about in workers_of(client).items():
        if about["nthreads"] != 1:
            raise DiffractionError(
                f"worker {address} has {about['nthreads']} Dask threads, of which Dr.Jit takes one "
                "at a time: start it with 'dask worker --nthreads 1'"
            )
    asked = (str,) if variant is None else (set_variant, variant)
    answers = client.run(called, versions(), *asked, on_error="return")
    for address, answer in answers.items():
        if isinstance(answer, Exception) and not isinstance(answer, OSError):
            reason = one_line(str(getattr(answer, "text", answer)))
            raise DiffractionError(f"worker {address} is of no use: {reason}")
    # the others have just gone
    return [address for address, answer in answers.items() if not isinstance(answer, OSError)]


def workers_of(client: Any) -> dict[str, Any]:
    """Return the scheduler's description of its workers, by address; empty while it is gone."""
    if client.status != "running":  # it would be waited for
        return {}
    try:
        return dict(client.scheduler_info(n_workers=-1).get("workers", {}))
    except (OSError, CancelledError):
        return {}


def warn_of_memory(client: Any, needed: float) -> None:
    """Warn of workers whose memory limit is below the estimated need of a task, in bytes."""
    for address, about in workers_of(client).items():
        limit = about.get("memory_limit") or 0
        if 0 < limit < needed:
            warn(
                f"worker {address} may use {limit / 1e9:.2g} GB, and a task is estimated to need "
                f"{needed / 1e9:.2g} GB; start fewer workers, or smaller pictures"
            )


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
