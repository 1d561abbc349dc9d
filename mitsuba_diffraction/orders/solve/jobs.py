"""Stations solved here, in other processes or on a cluster, and stored as they are done."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...arrays import Complex, Real
from ...atomic import make_folder
from ...digests import key_of
from ...errors import DiffractionError, check_choice, one_line
from ...progress import Progress, silent
from ...system import environment
from ...tables.store import Record, found, write_record
from .chandezon import Chandezon, refused
from .coupled import CoupledWaves
from .crossed import CrossedWaves
from .grating_index import TabulatedIndex
from .integral import IntegralSolver
from .nodes import AnyPlace, CrossedPlace
from .sheet import sheet_efficiencies
from .stations import LEAST_COSINE, Grating, Solver, on_both_sides

Spot = TypeVar("Spot", bound=AnyPlace)
#: Calls a function with each argument, and yields the number and the result of a call as it
#: finishes.
Calls = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[tuple[int, Any]]]

#: Solvers by name: from a profile, a resolution (points on the boundary; harmonics) and, where they
#: solve layers, a structure.
METHODS: dict[str, Callable[..., Solver]] = {
    "integral": IntegralSolver, "coupled": CoupledWaves, "chandezon": Chandezon,
}  # fmt: skip
#: Method of crossed gratings, the only one.
CROSSED = "crossed"
LAYERED = ("coupled", "chandezon")
#: Least |cosine| of any order across the grooves (`stations.LEAST_COSINE`) in tables of all light,
#: by solvers that lose digits as 1/cosine: 1.7° from grazing, where diffuse light has 1e-3 of its
#: power. Listed light has the resolution that it needs there.
LEAST_COSINES = {"integral": 0.03}
#: Choice of the solver by the grating, see `method_for`.
AUTO = "auto"
#: Largest resolutions, whose matrices need less than 2 GB, and a minute or more for a station.
MOST_RESOLUTION = {"integral": 1000, "coupled": 400, "chandezon": 400, CROSSED: 12}
# Threads that libraries of linear algebra start in each process, which would compete for the cores
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Problem:
    """Grating, solver and its resolution; `digest` identifies the grating and the solver.

    Light nearer to grazing than `least_cosine` has the efficiencies there (`stations`).

    Raises a DiffractionError if the resolution is above `MOST_RESOLUTION`.
    """

    grating: Grating = field(compare=False)
    method: str
    resolution: int
    digest: str
    least_cosine: float = LEAST_COSINE

    def __post_init__(self) -> None:
        if self.resolution > MOST_RESOLUTION[self.method]:
            raise DiffractionError(
                f"{self.grating.profile.name} would be solved at resolution {self.resolution}, and "
                f"method {self.method} solves up to {MOST_RESOLUTION[self.method]}: check that "
                "its lengths are in µm; it may be too deep, or too rough, for the shortest "
                "wavelength; slopes may be solved by method=chandezon"
            )


def method_for(grating: Grating) -> str:
    """Return the solver for a grating.

    Chandezon's method for slopes, also under films; coupled waves for other films, for slices and
    for lamellar profiles of metal no deeper than twice their period, else the integral method.
    """
    profile = grating.line
    flat = profile.depth == 0.0
    sloped = not (grating.is_perfect or grating.thin or flat or refused(profile))
    if sloped and not grating.structure.is_beneath:
        return "chandezon"
    shallow = profile.is_lamellar and profile.depth <= 2.0 * profile.period
    lamellar = shallow and not (grating.is_perfect or grating.thin)
    return "coupled" if grating.structure or lamellar else "integral"


def problem_of(grating: Grating, method: str, resolution: int) -> Problem:
    """Return a problem with its digest.

    Raises a DiffractionError if the method is unknown.
    """
    material = grating.material
    if (cell := grating.cell) is not None:
        check_choice("method", method, (AUTO, "coupled"))
        outline: tuple[object, ...] = CROSSED, cell.periods, grating.wavelengths
        digest = key_of(outline, cell.heights.tolist(), _numbers(material))
        return Problem(grating, CROSSED, resolution, digest)
    if method == AUTO:
        method = method_for(grating)
    check_choice("method", method, (AUTO, *METHODS))
    structure = grating.structure
    if structure and (method not in LAYERED or (structure.is_beneath and method != "coupled")):
        raise DiffractionError(
            f"method {method} does not solve these layers; use method=coupled, or leave out "
            "layers, beneath and substrate"
        )
    outline = "amplitudes", method, grating.superstrate, grating.wavelengths, grating.thin
    profile = grating.line
    digest = key_of(
        outline, grating.block, profile.period, profile.x.tolist(), profile.z.tolist(),
        [film.thickness for film in structure.films],
        [(each.thickness, [part[1:] for part in each.parts]) for each in structure.slices],
        [_numbers(medium) for medium in (material, *structure.materials)],
    )  # fmt: skip
    return Problem(grating, method, resolution, digest, LEAST_COSINES.get(method, LEAST_COSINE))


def _numbers(material: TabulatedIndex) -> list[Any]:
    """Return the wavelengths and indices of a material, as a key has them."""
    values = [] if material.values is None else material.values.view(np.float64).tolist()
    return [material.wavelengths.tolist(), values]


@lru_cache(maxsize=2)
def solver_of(problem: Problem) -> Solver:
    """Return the solver of a problem; a process keeps the last ones."""
    grating = problem.grating
    if grating.cell is not None:
        return CrossedWaves(grating.cell, problem.resolution)
    layers = [grating.structure] if grating.structure else []
    return METHODS[problem.method](grating.profile, problem.resolution, *layers)


# Suffix of files of results.
_SUFFIX = ".solved"


class Solved(NamedTuple):
    """Numbers of a solution, and the processor seconds that they took.

    values : of a place, amplitudes (w, j, 2, q, 2), see `stations.Solver`, of single precision. For
        a sheet, whose light has no phase, they are roots of its efficiencies.
    """

    values: NDArray[Any]
    seconds: float


def solve_place(problem: Problem, place: AnyPlace) -> Solved:
    """Solve a place.

    Values are rounded as they are stored, so that a table is the same whether or not it was
    interrupted.

    Raises a DiffractionError if the solver fails on the profile, or has too few harmonics.
    """
    solver = solver_of(problem)
    start, grating = time.thread_time(), problem.grating
    station: Any
    if isinstance(place, CrossedPlace):
        station = grating.crossed_station(place.x, place.y, place.w[0])
    else:
        w = place.w[:1] if grating.is_perfect else place.w
        station = grating.station(
            place.band, place.kind, place.tau, place.rho, w, problem.least_cosine
        )
        if problem.method in LAYERED:
            numbers = np.append(station.inside, [0, station.channels - 1]) - station.channels // 2
            if (needed := int(np.abs(numbers).max())) > problem.resolution:
                raise DiffractionError(
                    f"{grating.profile.name} at resolution {problem.resolution}: more orders "
                    f"propagate; use a resolution of at least {needed}, or leave it out"
                )
    try:
        values = solver.amplitudes(station)
    except DiffractionError:
        raise
    except (ValueError, np.linalg.LinAlgError) as error:  # numbers that are not finite
        raise DiffractionError(
            f"method {problem.method} cannot solve {grating.profile.name} "
            f"({one_line(str(error))}); check that its line neither touches nor nearly touches "
            "itself"
        ) from error
    if grating.thin:
        values = np.sqrt(sheet_efficiencies(values, station))
    if grating.block:
        values = on_both_sides(values, station)
    return Solved(values.astype(np.complex64), time.thread_time() - start)


def calls_here(work: Callable[[Any], Any], arguments: Iterable[Any]) -> Iterator[tuple[int, Any]]:
    """Call a function in this process, in the order of the arguments; see `Calls`."""
    return enumerate(map(work, arguments))


def calls_in(
    pool: Executor, work: Callable[[Any], Any], arguments: Iterable[Any]
) -> Iterator[tuple[int, Any]]:
    """Call a function in the processes of a pool; see `Calls`."""
    futures = {pool.submit(work, argument): n for n, argument in enumerate(arguments)}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()


@dataclass
class Jobs:
    """Where stations are solved, and kept: none is solved twice.

    Attributes
    ----------
    folder : of results, which another run finds again, made when needed; None keeps them in memory
        alone.
    calls : solves, in other processes or on a cluster; by default here, a place after the other.
    progress : called as progress(done, total, text).
    announce : called with the `settings.Estimate` of each stage before it starts; None for none.
    """

    folder: Path | None = None
    calls: Calls = calls_here
    progress: Progress = silent
    announce: Callable[[Any], None] | None = None
    _known: dict[str, Solved] = field(default_factory=dict, init=False)

    def solve(self, problem: Problem, places: Sequence[Spot], text: str) -> dict[Spot, Real]:
        """Return the efficiencies at all places; see `amplitudes`."""
        known = self.amplitudes(problem, places, text)
        return {place: np.abs(values) ** 2 for place, values in known.items()}

    def amplitudes(
        self, problem: Problem, places: Sequence[Spot], text: str
    ) -> dict[Spot, Complex]:
        """Return the amplitudes at all places, of which those in the folder are read.

        An exception or Ctrl-C leaves finished results in the folder.

        Raises a DiffractionError if the folder cannot be written.
        """
        names, missing = _names(problem, places), self.missing(problem, places)
        if self.folder is not None and missing:
            make_folder(self.folder)
        done = len(names) - len(missing)
        self.progress(done, len(names), text)
        for n, solved in self.calls(partial(solve_place, problem), missing):
            name = names[missing[n]]
            self._known[name] = solved
            if self.folder is not None:
                record = Record({"seconds": solved.seconds}, [solved.values])
                write_record(self._file(name), _title(name), record)
            done += 1
            self.progress(done, len(names), text)
        return {place: self._known[n].values.astype(np.complex128) for place, n in names.items()}

    def missing(self, problem: Problem, places: Iterable[Spot]) -> list[Spot]:
        """Return the places without a solution, here or in the folder."""
        names = _names(problem, places)
        if self.folder is not None:
            for name in names.values():
                if name not in self._known:
                    solved = found(self._file(name), _title(name), _solved_in)
                    self._known |= {name: solved} if solved else {}
        return [place for place, name in names.items() if name not in self._known]

    def _file(self, name: str) -> Path:
        assert self.folder is not None
        return self.folder / f"{name}{_SUFFIX}"

    @property
    def processor_seconds(self) -> float:
        """Processor seconds of all solutions so far, including solutions read from the folder."""
        return sum(solved.seconds for solved in self._known.values())


def _names(problem: Problem, places: Iterable[Spot]) -> dict[Spot, str]:
    """Return the names of the solutions of places."""
    outline = problem.digest, problem.resolution, problem.least_cosine
    return {place: key_of(*outline, place)[:24] for place in places}


@contextmanager
def processes(count: int) -> Iterator[Executor]:
    """Yield a pool of processes with one thread of linear algebra each.

    Raises a DiffractionError if one of them is killed.
    """
    pool = ProcessPoolExecutor(count, get_context("spawn"), initializer=_begin)
    try:
        with environment(dict.fromkeys(_THREADS, "1")):
            yield pool
    except BrokenExecutor as error:
        raise DiffractionError(
            "a process was killed, maybe for lack of memory; use fewer of them, and run the same "
            "command again, which resumes from stored results"
        ) from error
    except BaseException:
        # Ctrl-C does not wait for stations in progress
        for process in active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    """Leave Ctrl-C, which reaches all processes of a terminal, to the first, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def remove_results(folder: Path) -> None:
    """Remove the results in a folder, and the folder once it is empty."""
    with suppress(OSError):
        for file in folder.glob(f"*{_SUFFIX}"):
            file.unlink()
        folder.rmdir()


def _solved_in(record: Record) -> Solved:
    """Return a stored result; raises a ValueError if a number of it is not finite."""
    (values,) = record.arrays
    if not np.isfinite(values).all():
        raise ValueError("a number is not finite")
    return Solved(values, float(record.document["seconds"]))


def _title(name: str) -> str:
    """Return the first words of a result's file."""
    return f"mitsuba_diffraction solution {name}"
