"""Options of commands that may run on workers, and pictures rendered on them."""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..cluster import FrameRequest, FrameSequence, connect
from ..cluster.jobs import WorkerCalls
from ..cluster.workers import VARIABLE
from ..errors import counted
from ..system import cores
from .console import Bar, say
from .options import Group, refuse
from .values import whole_number

if TYPE_CHECKING:
    from ..orders.solve.jobs import Calls

#: Options that choose workers.
WORKERS = Group("workers (extra `cluster`)", (
    ("--workers N", "start N processes here for it", whole_number(1)),
    ("--scheduler ADDRESS", "use the Dask cluster of this scheduler, or of a scheduler file "
     f"(.json); default: that of ${VARIABLE}, if it is set"),
))  # fmt: skip
#: The number of Dr.Jit threads of a worker.
THREADS = (
    "--threads N", "Dr.Jit threads of a worker; default: its share of this machine's cores, or "
    "with --scheduler all that it may use", whole_number(1),
)  # fmt: skip


def on_workers(args: argparse.Namespace) -> bool:
    """Say whether the command runs on workers; contradictory options are a usage error."""
    if args.workers and args.scheduler:
        args.parser.error("argument --workers: starts workers; --scheduler has its own")
    wanted = bool(args.workers or args.scheduler or os.environ.get(VARIABLE))
    if not wanted:
        refuse(args, ["threads"], ": is for --workers or --scheduler")
    return wanted


def worker_threads(args: argparse.Namespace) -> int:
    """Return the Dr.Jit threads of a worker; 0 for one a core."""
    if args.threads or not args.workers:
        return args.threads or 0
    return max(1, cores() // int(args.workers))


@contextlib.contextmanager
def client_of(args: argparse.Namespace) -> Iterator[Any]:
    """Connect to the requested workers, and print the address of their pages; None without any."""
    if not on_workers(args):
        yield None
        return
    has_page = importlib.util.find_spec("bokeh") is not None
    with connect(args.workers, args.scheduler) as client:
        if not args.workers or has_page:
            say(f"workers at {client.dashboard_link}")
        yield client


@contextlib.contextmanager
def film_of(
    args: argparse.Namespace, frames: Sequence[FrameRequest], variant: str, keep: Path
) -> Iterator[FrameSequence]:
    """Connect to the requested workers, and yield the renderer of the command's frames on them."""
    with client_of(args) as client:
        with Bar(args, delay=0) as bar:
            bar(0, 0, "loading")
            film = FrameSequence(
                client, args.scene, frames, variant, keep=keep, sensor=args.sensor,
                preview=args.preview, threads=worker_threads(args),
            )  # fmt: skip
        say_files(path for task in film.frames for path, _ in task.files.files)
        say(f"a task is estimated to need {film.needed / 1e9:.2g} GB of memory")
        yield film


def say_files(files: Iterable[str | os.PathLike[str]]) -> None:
    """Print the files that are sent to workers without them, before the first is sent."""
    here = Path.cwd()
    sent = sorted({Path(os.path.abspath(file)) for file in files})
    names = (str(file.relative_to(here) if file.is_relative_to(here) else file) for file in sent)
    say(f"files for workers that lack them: {', '.join(names)}")


def say_report(film: FrameSequence) -> dict[str, Any]:
    """Print the workers' statistics in a line, and return them as plain data."""
    report = film.report.summary()
    kept = f", {report['kept']} stored before" if report["kept"] else ""
    lost = f", {counted(report['lost'], 'worker')} lost" if report["lost"] else ""
    again = f", {report['retries']} given out again" if report["retries"] else ""
    print(
        f"workers: {counted(report['tasks'], 'task')} in "
        f"{counted(report['groups'], 'sum')}{kept}{again}{lost}, "
        f"{report['busy']:.1f} s of work by "
        f"{counted(len(report['workers']), 'worker')} in {report['seconds']:.1f} s, "
        f"{report['overhead_per_task_s']:.2g} s a task beside it, {report['bytes'] / 1e6:.3g} MB, "
        f"{report['peak'] / 1e9:.2g} GB of memory at most"
    )
    return report


@contextlib.contextmanager
def calls_for(args: argparse.Namespace) -> Iterator[tuple[Calls, int]]:
    """Yield what calls functions in the requested processes, and the number of processes."""
    if on_workers(args):
        refuse(args, ["jobs"], ": is for this machine; --workers has its own")
        with client_of(args) as client:
            calls = WorkerCalls(client)
            yield calls.finished, calls.workers
        return
    from ..orders.solve.jobs import calls_in, processes

    jobs, most = args.jobs or 1, 4 * cores()
    if jobs > most:
        args.parser.error(f"argument --jobs: expected 1 to {most}, 4 for each core, got {jobs}")
    with processes(jobs) as pool:
        yield partial(calls_in, pool), jobs
