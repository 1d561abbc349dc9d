"""`python -m tests.fuzz`: random cases, for a time or a number; exit code 1 if any failed."""

from __future__ import annotations

import argparse
import faulthandler
import json
import secrets
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
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
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--log", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    kinds = args.kind or list(KINDS)
    if args.case is not None:
        _prepare()
        run_case(kinds[0], args.seed or 0, args.case)
        return 0
    seed = secrets.randbelow(2**31) if args.seed is None else args.seed
    if args.worker is not None:
        return _work(args, kinds, seed)
    print(f"seed {seed}", flush=True)
    return _supervise(args, kinds, seed)


def _supervise(args: argparse.Namespace, kinds: list[str], seed: int) -> int:
    """Run the workers in processes of their own, which may die."""
    start = time.monotonic()
    failed, counts = [], dict.fromkeys(kinds, 0)
    with tempfile.TemporaryDirectory() as folder:
        workers = []
        for n in range(args.jobs):
            log = Path(folder, f"{n}.jsonl")
            words = ["--seed", seed, "--seconds", args.seconds, "--jobs", args.jobs]
            words += [] if args.rounds is None else ["--rounds", args.rounds]
            words += ["--worker", n, "--log", log, *(w for k in kinds for w in ("--kind", k))]
            command = [sys.executable, "-m", "tests.fuzz", *map(str, words)]
            workers.append((log, subprocess.Popen(command)))
        for log, worker in workers:
            code = worker.wait()
            written = log.read_text("utf-8") if log.exists() else ""
            entries = [json.loads(line) for line in written.splitlines()]
            for entry in entries:
                counts[entry["kind"]] += "text" not in entry
            failed += [entry for entry in entries if "text" in entry]
            if code < 0 or (code > 0 and entries):
                failed.append(entries[-1] | {"text": f"the process ended with exit code {code}"})
            elif code:
                failed.append({"kind": kinds[0], "number": 0, "text": "no case was run"})
    for entry in failed:
        repeat = f"--kind {entry['kind']} --seed {seed} --case {entry['number']}"
        print(f"FAILED python -m tests.fuzz {repeat}: {entry['text']}")
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()), end="")
    print(f" in {time.monotonic() - start:.0f} s: {len(failed)} failed")
    return 1 if failed else 0


def _work(args: argparse.Namespace, kinds: list[str], seed: int) -> int:
    """Run cases: each is logged before it begins, and again if it fails."""
    _prepare()
    cases = _timed(args, kinds) if args.rounds is None else _counted(args, kinds)
    with own_program(), args.log.open("w", encoding="utf-8", buffering=1) as log:
        for kind, number in cases:
            entry = {"kind": kind, "number": number}
            print(json.dumps(entry), file=log)
            text = _failure(kind, seed, number)
            if text:
                print(json.dumps(entry | {"text": text}), file=log)
    return 0


def _timed(args: argparse.Namespace, kinds: list[str]) -> Iterator[tuple[str, int]]:
    """Yield a worker's cases until the time is up, each kind for its share of it."""
    start = time.monotonic()
    spent = dict.fromkeys(kinds, 0.0)
    number = dict.fromkeys(kinds, args.worker)
    while (begin := time.monotonic()) - start < args.seconds:
        kind = min(kinds, key=lambda k: spent[k] / KINDS[k].share)
        yield kind, number[kind]
        spent[kind] += time.monotonic() - begin
        number[kind] += args.jobs


def _counted(args: argparse.Namespace, kinds: list[str]) -> Iterator[tuple[str, int]]:
    """Yield a worker's cases of `--rounds`: the same on every machine, however fast."""
    for kind in kinds:
        for number in range(args.worker, args.rounds * KINDS[kind].round, args.jobs):
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
    sys.exit(main())
