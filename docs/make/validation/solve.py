"""Solve cases rigorously, and write the files of data/.

python -m docs.make.validation.solve perfect_integral     # minutes to an hour; extra `validation`
python -m docs.make.validation.solve keratin_patches_rayleigh     # in two dimensions; a minute
python -m docs.make.validation.solve coated               # under a coat; half an hour
python -m docs.make.validation.solve films                # under a film; seconds
"""

from __future__ import annotations

import argparse
import datetime
import itertools
import multiprocessing
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from docs.make.figures.pages import option, program, progress_option
from mitsuba_diffraction.cli import Bar, check_outputs

from . import coated, coupled_wave, filmed, integral, patch_solutions
from .cases import MATERIALS, Scan, index_text, scans
from .solutions import DATA, LIGHTS, Solutions, Work, order_rows, save_rows

#: Each solves a `Scan` at one of its `resolutions`.
SOLVERS: dict[str, ModuleType] = {"integral": integral, "coupled_wave": coupled_wave}


def of_gratings(material: str, solver: str) -> Work:
    """Return all scans of a material, or those that both solvers are compared on."""
    method, wanted = SOLVERS[solver], scans(material)
    if method is coupled_wave:
        wanted = coupled_wave.part_of(wanted)
    file = f"{material}_{solver}"
    about = {"solver": method.name(), "material": material, "index": index_text(material)}
    return Work(wanted, partial(_by_file, file, solver), {file: about})


#: Cases by the names of the command.
WORKS: dict[str, Callable[[], Work]] = {
    **{
        f"{material}_{solver}": partial(of_gratings, material, solver)
        for material in MATERIALS
        for solver in SOLVERS
        if material != "perfect" or solver == "integral"  # coupled waves need an index
    },
    **{
        patch_solutions.file_of(material, solver): partial(patch_solutions.work, material, solver)
        for material in ("aluminium", "keratin")
        for solver in patch_solutions.SOLVERS
    },
    "coated": coated.work,
    "films": filmed.work,
}


def _by_file(file: str, solver: str, scan: Scan) -> dict[str, NDArray[np.void]]:
    return {file: solve_scan(scan, solver=solver)}


def solve_scan(
    scan: Scan, resolutions: Sequence[Any] | None = None, *, solver: str = "integral"
) -> NDArray[np.void]:
    """Rows of one scan.

    It is solved at the first two resolutions, by default the solver's own; wavelengths that have
    not converged between these (`solutions.CONVERGED`) at the next ones, as far as there are any.
    """
    method = SOLVERS[solver]
    levels = list(resolutions or method.resolutions(scan))
    rows_of_scan = _solve_twice(scan, method, levels[0], levels[1])
    for coarse, fine in itertools.pairwise(levels[1:]):
        open_ones = np.unique(rows_of_scan.rows["wavelength"][~rows_of_scan.converged])
        if not len(open_ones):
            break
        part = replace(scan, wavelengths=tuple(float(w) for w in open_ones))
        better = _solve_twice(part, method, coarse, fine)
        rows = rows_of_scan.rows.copy()
        rows[np.isin(rows["wavelength"], open_ones)] = better.rows
        rows_of_scan = Solutions(rows, {})
    return rows_of_scan.rows


def _solve_twice(scan: Scan, method: ModuleType, first: Any, final: Any) -> Solutions:
    """A scan at the `final` resolution, with the change from the `first` one."""
    coarse, fine = method.solve(scan, first), method.solve(scan, final)
    rows = [
        order_rows(
            scan.grating, scan.theta, wavelength,
            *([each.orders[light][n] for light in LIGHTS] for each in (coarse, fine)),
            balance=[fine.balance[light][n] for light in LIGHTS],
        )
        for n, wavelength in enumerate(scan.wavelengths)
    ]  # fmt: skip
    return Solutions(np.concatenate(rows), {})


#: Threads of one process: BLAS in each would fight the others for the processors.
_ONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def _jobs(text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got '{text}'")
    return count


@program(
    option("name", metavar="NAME", choices=tuple(WORKS), help=f"one of {', '.join(WORKS)}"),
    option("-o", "--output", metavar="FOLDER", type=Path, default=DATA),
    option("-j", "--jobs", metavar="N", type=_jobs, help="processes; all processors"),
    progress_option(),
)
def main(args: argparse.Namespace) -> None:
    """Solve the cases of a name and write their files."""
    work = WORKS[args.name]()
    paths = {file: args.output / f"{file}.npz" for file in work.about}
    check_outputs(list(paths.values()))
    rows: dict[str, list[NDArray[np.void]]] = {file: [] for file in paths}
    # Children start anew: what they inherit of BLAS's threads could not be changed
    with (
        Bar(args, unit=" cases") as bar,
        mock.patch.dict(os.environ, _ONE),
        multiprocessing.get_context("spawn").Pool(args.jobs) as pool,
    ):
        for n, solved in enumerate(pool.imap(work.solve, work.cases)):
            for file, part in solved.items():
                rows[file].append(part)
            bar(n + 1, len(work.cases), f"solving {args.name}")
    made = {
        "command": f"python -m docs.make.validation.solve {args.name}",
        "date": datetime.date.today().isoformat(),
    }
    for file, path in paths.items():
        every = np.concatenate(rows[file])
        save_rows(every, made | work.about[file], path)
        change = max(np.nanmax(every[c]) for c in every.dtype.names or () if c.endswith("change"))
        print(
            f"wrote {path}: {len(every)} orders; the last refinement changed them by "
            f"{change:.1g} at most"
        )
