"""`python -m tests.fuzz`: random cases, for a time or a number; exit code 1 if any failed."""

from __future__ import annotations

import argparse
import faulthandler
import importlib
import multiprocessing
import secrets
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection, wait
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.streams import own_program
from tests.fuzz import command_lines, damage, energy, orders, surfaces


class Kind(NamedTuple):
    """A kind of cases: what checks one, and the number that decides its random numbers.

    Attributes
    ----------
    round : cases that take about a second together.
    share : of the time, relative to others.
    """

    check: Callable[[np.random.Generator], None]
    stream: int
    round: int
    share: float = 1.0


KINDS = {
    "tables": Kind(damage.check_table, 3, 30),
    "documents": Kind(damage.check_document, 5, 50),
    "heights": Kind(damage.check_heights, 1, 20),
    "texts": Kind(damage.check_text, 4, 30),
    "commands": Kind(command_lines.check, 0, 10),
    "surfaces": Kind(surfaces.check, 2, 2),
    "scenes": Kind(damage.check_scene, 7, 20),
    "orders": Kind(orders.check, 10, 30),
    "energy": Kind(energy.check, 11, 1, share=2.0),
}
#: Seconds of the processor, and by the clock of a busy machine, that a case may take; most take
#: less than one, and some where kernels are compiled on a slow machine. Scales of energy of a thick
#: film whose lengths vary take a minute.
_BUSY, _HANG = 90, 900
_SHOWN = 300  # characters of a failure


def run_case(kind: str, seed: int, number: int) -> None:
    """One case; the same numbers make the same case.

    Raises
    ------
    AssertionError
        Or whatever else the case raises, if it fails.
    """
    rng = np.random.default_rng([seed, KINDS[kind].stream, number])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        KINDS[kind].check(rng)


def main() -> int:
    """Start the workers, and collect what they found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument(
        "--rounds", type=int,
        help="instead of a time: so many times the few cases of tests/fuzz/test_fuzz.py",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=None, help="default: a new one, printed")
    parser.add_argument("--kind", choices=KINDS, action="append", help="default: all")
    parser.add_argument("--case", type=int, help="this one only, with --seed and --kind")
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    kinds = args.kind or list(KINDS)
    if args.case is not None:
        _prepare()
        run_case(kinds[0], args.seed or 0, args.case)
        return 0
    seed = secrets.randbelow(2**31) if args.seed is None else args.seed
    print(f"seed {seed}", flush=True)
    return _supervise(args, kinds, seed)


def _supervise(args: argparse.Namespace, kinds: list[str], seed: int) -> int:
    """Run the workers in processes of their own, which may die."""
    start, failed, counts = time.monotonic(), [], dict.fromkeys(kinds, 0)
    spawning = multiprocessing.get_context("spawn")
    workers = {}
    for n in range(args.jobs):
        told, tells = spawning.Pipe(duplex=False)
        worker = spawning.Process(target=_work, args=(tells, n, args, kinds, seed))
        worker.start()
        tells.close()
        workers[told] = worker
    last = dict.fromkeys(workers, (kinds[0], 0))
    while workers:
        for told in wait(list(workers)):
            try:
                kind, number, text = told.recv()
            except EOFError:
                (worker := workers.pop(told)).join()
                if worker.exitcode:
                    text = f"the process ended with exit code {worker.exitcode}"
                    failed.append((*last[told], text))
                continue
            last[told] = kind, number
            if text:
                failed.append((kind, number, text))
            counts[kind] += text is None
    for kind, number, text in failed:
        repeat = f"--kind {kind} --seed {seed} --case {number}"
        print(f"FAILED python -m tests.fuzz {repeat}: {text}")
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()), end="")
    print(f" in {time.monotonic() - start:.0f} s: {len(failed)} failed")
    return 1 if failed else 0


def _work(
    told: Connection, worker: int, args: argparse.Namespace, kinds: list[str], seed: int
) -> None:
    """Run cases: each is told before it begins, and again if it fails."""
    _prepare()
    cases = _timed if args.rounds is None else _counted
    with own_program():
        for kind, number in cases(args, kinds, worker):
            told.send((kind, number, None))
            if text := _failure(kind, seed, number):
                told.send((kind, number, text))


def _timed(args: argparse.Namespace, kinds: list[str], worker: int) -> Iterator[tuple[str, int]]:
    """Yield a worker's cases until the time is up, each kind for its share of it."""
    start = time.monotonic()
    spent = dict.fromkeys(kinds, 0.0)
    number = dict.fromkeys(kinds, worker)
    while (begin := time.monotonic()) - start < args.seconds:
        kind = min(kinds, key=lambda k: spent[k] / KINDS[k].share)
        yield kind, number[kind]
        spent[kind] += time.monotonic() - begin
        number[kind] += args.jobs


def _counted(args: argparse.Namespace, kinds: list[str], worker: int) -> Iterator[tuple[str, int]]:
    """Yield a worker's cases of `--rounds`: the same on every machine, however fast."""
    for kind in kinds:
        for number in range(worker, args.rounds * KINDS[kind].round, args.jobs):
            yield kind, number


def _failure(kind: str, seed: int, number: int) -> str:
    """What went wrong in a case, or nothing."""
    signal.setitimer(signal.ITIMER_PROF, _BUSY)
    signal.alarm(_HANG)
    faulthandler.dump_traceback_later(2 * _HANG, exit=True)  # where Python's alarm is not heard
    try:
        run_case(kind, seed, number)
    except Exception as error:
        return f"{type(error).__name__}: {error}"[:_SHOWN].replace("\n", " ")
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.alarm(0)
        faulthandler.cancel_dump_traceback_later()
    return ""


def _prepare() -> None:
    """An alarm that raises; what takes seconds to import."""
    signal.signal(signal.SIGPROF, _hangs)
    signal.signal(signal.SIGALRM, _hangs)
    import SurfaceTopography  # noqa: F401  takes seconds, which no case shall be charged for


def _hangs(*_: object) -> None:
    raise TimeoutError(f"takes over {_BUSY} s")


if __name__ == "__main__":
    # processes are not started from a module of this name
    sys.exit(importlib.import_module("tests.fuzz.__main__").main())
