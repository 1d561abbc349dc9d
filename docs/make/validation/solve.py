"""Rigorous solutions of all scans, each at two resolutions or more, on all processors."""

from __future__ import annotations

import contextlib
import datetime
import functools
import itertools
import multiprocessing
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.progress import Progress

from . import coupled_wave, integral
from .cases import ALUMINIUM, KERATIN, PROFILES, Scan, order_sines, scans
from .solutions import ROW, Solutions

#: Each solves a `Scan` at one of its `resolutions`.
SOLVERS: dict[str, ModuleType] = {"integral": integral, "coupled_wave": coupled_wave}

_INDEX = {
    "perfect": "perfect conductor",
    "aluminium": ", ".join(f"{n:g} at {w:g} nm" for w, n in ALUMINIUM.items()),
    "keratin": f"{KERATIN:g}",
}


def solve_material(
    material: str,
    solver: str = "integral",
    *,
    processes: int | None = None,
    progress: Progress | None = None,
) -> Solutions:
    """Solve all scans of a material, which takes from minutes to an hour.

    Parameters
    ----------
    material : one of `cases.MATERIALS`.
    solver : of `SOLVERS`; coupled waves solve a part of the scans, for comparison.
    processes : how many at a time; by default one per processor.
    progress : called as progress(done, total, text).

    Raises
    ------
    DiffractionError
        If the material or solver is unknown, the solver cannot do this material or is not
        installed.
    """
    wanted = scans(material)
    if solver not in SOLVERS:
        raise DiffractionError(f"solver '{solver}' is unknown; choose one of {', '.join(SOLVERS)}")
    method = SOLVERS[solver]
    if not method.available():
        raise DiffractionError(
            f"the solver '{solver}' is not installed; pip install '.[validation]'"
        )
    if method is coupled_wave:
        wanted = coupled_wave.part_of(wanted)
    rows: list[NDArray[np.void]] = []
    # Children start anew: what they inherit of BLAS's threads could not be changed
    with _one_thread_each(), multiprocessing.get_context("spawn").Pool(processes) as pool:
        results = pool.imap(functools.partial(solve_scan, solver=solver), wanted)
        for n, result in enumerate(results):
            rows.append(result)
            if progress:
                progress(n + 1, len(wanted), f"solving {material}")
    about = {
        "command": f"python -m docs.make.validation solve {material} --solver {solver}",
        "date": datetime.date.today().isoformat(),
        "solver": method.name(),
        "material": material,
        "index": _INDEX[material],
    }
    return Solutions(np.concatenate(rows), about)


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
    rows = []
    for n, wavelength in enumerate(scan.wavelengths):
        orders, _ = order_sines(scan.grating.period, wavelength, scan.theta)
        part = np.empty(len(orders), ROW)
        part["profile"] = PROFILES.index(scan.grating.profile)
        part["period"], part["depth"] = scan.grating.period, scan.grating.depth
        part["theta"], part["wavelength"], part["order"] = scan.theta, wavelength, orders
        for polarisation in ("te", "tm"):
            final_values = fine.orders[polarisation][n]
            part[polarisation] = final_values
            part[f"{polarisation}_change"] = np.abs(final_values - coarse.orders[polarisation][n])
            part[f"{polarisation}_balance"] = fine.balance[polarisation][n]
        rows.append(part)
    return Solutions(np.concatenate(rows), {})


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """BLAS in each process would fight the others for the processors."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
