"""Workers: started here, or those of a running cluster; which are of use, and what they are."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import threading
from collections.abc import Iterator
from typing import Any

from ..errors import DiffractionError, one_line
from .tasks import check_versions, versions

#: Names a running cluster, as Dask has it.
VARIABLE = "DASK_SCHEDULER_ADDRESS"
_PATIENCE = 60.0  # seconds for the first worker to come


@contextlib.contextmanager
def connect(
    count: int | None = None,
    scheduler: str | None = None,
    *,
    dashboard: bool = True,
    patience: float = 10.0,
) -> Iterator[Any]:
    """A `distributed.Client`: of `count` processes started here, or of a running cluster.

    Parameters
    ----------
    count : processes, of one Dask thread each.
    scheduler : address, or the name of a scheduler file (.json); by default
        $DASK_SCHEDULER_ADDRESS.
    patience : seconds for the scheduler to answer.

    Raises
    ------
    DiffractionError
        If Dask is not installed, or nobody answers at the address.
    """
    distributed = require_dask()
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # ours are the words
    if count is not None:
        with _ctrl_c_ignored():  # by the processes that are started: it is for the client
            cluster = distributed.LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True,
                dashboard_address=":0", silence_logs=logging.CRITICAL,
            )  # fmt: skip
        with cluster, distributed.Client(cluster) as client:
            client.register_plugin(_apart(distributed))
            yield client
        return
    address = scheduler or os.environ.get(VARIABLE)
    if not address:
        raise DiffractionError(
            f"there is no cluster: say how many workers to start, or name a scheduler (--workers, "
            f"--scheduler, or {VARIABLE})"
        )
    named = {"scheduler_file" if address.endswith(".json") else "address": address}
    try:
        client = distributed.Client(**named, timeout=patience)
    except (OSError, ValueError, TimeoutError) as error:
        raise DiffractionError(
            f"no scheduler answers at '{address}' ({one_line(str(error))[:80]}); start one with "
            "'dask scheduler', and workers with 'dask worker --nthreads 1'"
        ) from error
    with client:
        yield client


def require_dask() -> Any:
    """The module `distributed`.

    Raises
    ------
    DiffractionError
        If it is not installed.
    """
    try:
        import distributed
    except ImportError as error:
        raise DiffractionError(
            "workers need Dask, which is not installed: pip install 'mitsuba-diffraction[cluster]'"
        ) from error
    return distributed


def check_workers(client: Any, variant: str | None) -> list[str]:
    """Refuse workers that are of no use, by name; the addresses of all.

    Parameters
    ----------
    client : `distributed.Client`.
    variant : of Mitsuba that they have to work in; None where that does not matter.

    Raises
    ------
    DiffractionError
        If there are none, or one has several Dask threads, other versions, or no LLVM or GPU.
    """
    distributed = require_dask()
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except (TimeoutError, distributed.TimeoutError) as error:
        raise DiffractionError(
            f"no worker came within {_PATIENCE:.0f} s; start some with 'dask worker --nthreads 1'"
        ) from error
    for address, about in client.scheduler_info(n_workers=-1)["workers"].items():
        if about["nthreads"] != 1:
            raise DiffractionError(
                f"worker {address} has {about['nthreads']} Dask threads, of which Dr.Jit takes one "
                "at a time: start it with 'dask worker --nthreads 1'"
            )
    found = client.run(_trouble, versions(), variant, on_error="return")
    for address, trouble in found.items():
        if trouble is not None:
            raise DiffractionError(f"worker {address} is of no use: {one_line(str(trouble))}")
    return list(found)


def memory_warnings(client: Any, needed: float) -> Iterator[str]:
    """Lines on workers whose memory limit is below what a task is estimated to need, in bytes."""
    for address, about in client.scheduler_info(n_workers=-1)["workers"].items():
        limit = about.get("memory_limit") or 0
        if 0 < limit < needed:
            yield (
                f"worker {address} may use {limit / 1e9:.2g} GB, and a task is estimated to need "
                f"{needed / 1e9:.2g} GB; start fewer workers, or smaller pictures"
            )


def _trouble(wanted: tuple[str, ...], variant: str | None) -> str | None:
    """What keeps this process from being of use; None if nothing does."""
    from ..scene.load import set_variant

    try:
        check_versions(wanted)
        if variant is not None:
            set_variant(variant)
    except DiffractionError as error:
        return str(error)
    return None


def _apart(distributed: Any) -> Any:
    """A plugin that takes workers out of the terminal's reach, late ones too.

    Mitsuba answers Ctrl-C itself while it renders, and a scalar variant leaves its pass unfinished.
    """

    class Apart(distributed.WorkerPlugin):
        def setup(self, worker: Any) -> None:
            with contextlib.suppress(OSError):  # it leads a session already
                os.setsid()

    return Apart()


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
