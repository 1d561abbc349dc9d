"""Solve cases rigorously, and write the files of data/.

python -m docs.make.validation.solve perfect_integral     # minutes to an hour; extra `validation`
python -m docs.make.validation.solve keratin_patches_rayleigh     # in two dimensions; a minute
python -m docs.make.validation.solve coated               # under a coat; a minute
python -m docs.make.validation.solve films                # under a film; seconds
"""

from __future__ import annotations

import argparse
import datetime
import itertools
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from docs.make.figures.pages import option, program, progress_option
from mitsuba_diffraction.cli import Bar, check_outputs
from mitsuba_diffraction.orders.solve import jobs
from mitsuba_diffraction.system import cores

from . import coated, coupled_wave, crossed, filmed, integral, rayleigh
from .cases import (
    DATA,
    FEW_WAVELENGTHS,
    MATERIALS,
    Case,
    Grating,
    Light,
    Media,
    grating_cases,
    index_text,
)
from .models import ANGLES
from .patches import cell_cases
from .solutions import Solved, save

#: Each solves a `Case` at one of its `resolutions`.
SOLVERS: dict[str, ModuleType] = {
    "integral": integral,
    "coupled_wave": coupled_wave,
    "patches_coupled_wave": crossed,
    "patches_rayleigh": rayleigh,
    "coated": coated,
    "films": filmed,
}
#: Cases by file, named without its suffix; all files of one command have as many.
Work = dict[str, list[Case]]


def of_material(material: str, solver: str) -> Work:
    """Return all cases of a material, or those that both solvers are compared on."""
    cells = solver.startswith("patches")
    cases = list(cell_cases(material)) if cells else grating_cases(material)
    return {
        f"{material}_{solver}": coupled_wave.part_of(cases) if solver == "coupled_wave" else cases
    }


def of_layers(gratings: Sequence[Grating], media: dict[str, Media]) -> Work:
    """Return gratings under layers, by file."""
    lights = list(itertools.product(FEW_WAVELENGTHS, ANGLES))
    return {
        file: [Case(grating, Light(*light), each) for grating in gratings for light in lights]
        for file, each in media.items()
    }


#: Cases, and the name of their solver, by the names of the command.
WORKS: dict[str, tuple[Callable[[], Work], str]] = {
    **{
        f"{material}_{solver}": (partial(of_material, material, solver), solver)
        for solver in list(SOLVERS)[:4]
        for material in MATERIALS
        if material != "perfect" or solver == "integral"  # the others need an index
    },
    "coated": (partial(of_layers, coated.GRATINGS, coated.COATS), "coated"),
    "films": (
        partial(
            of_layers, filmed.GRATINGS, {filmed.file_of(n): m for n, m in filmed.FILMS.items()}
        ),
        "films",
    ),
}


def solve_case(
    case: Case, resolutions: Sequence[Any] | None = None, *, solver: str = "integral"
) -> Solved:
    """Solve a case at the first two resolutions, by default the solver's own.

    If it has not converged between these (`Solved.converged`), it is solved at the next ones, as
    far as there are any.
    """
    method = SOLVERS[solver]
    first, *finer = resolutions or method.resolutions(case)
    coarse = method.solve(case, first)
    for resolution in finer:
        fine = method.solve(case, resolution)
        solved = Solved.between(case, coarse, fine)
        if solved.converged:
            break
        coarse = fine
    return solved


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
    make, solver = WORKS[args.name]
    work, name = make(), SOLVERS[solver].name()
    paths = {file: args.output / f"{file}.npz" for file in work}
    check_outputs(list(paths.values()))
    # neighbours differ in their media alone, and share the solution of the surface
    cases = [case for same in zip(*work.values(), strict=True) for case in same]
    solved: list[Solved] = []
    with Bar(args, unit=" cases") as bar, jobs.processes(args.jobs or cores()) as pool:
        for each in pool.map(partial(solve_case, solver=solver), cases, chunksize=len(work)):
            solved.append(each)
            bar(len(solved), len(cases), f"solving {args.name}")
    for n, (file, path) in enumerate(paths.items()):
        media = work[file][0].media
        about = {
            "command": f"python -m docs.make.validation.solve {args.name}",
            "date": datetime.date.today().isoformat(),
            "solver": name,
            "material": media.text,
            "index": index_text(media.material),
        }
        every = save(solved[n :: len(work)], about, path)
        change = np.nanmax(every.column("change"))
        print(
            f"wrote {path}: {len(every.column('order'))} orders; the last refinement changed them "
            f"by {change:.1g} at most"
        )
