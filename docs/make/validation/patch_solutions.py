"""Rigorous solutions in two dimensions by two solvers, and their files.

Rayleigh's expansion (`rayleigh`) converges on all of these dielectrics, to a tenth of what coupled
waves in layers (`crossed`) do with as many harmonics as there is memory for, and on metals where
they are gentle, which coupled waves do not. Coupled waves, which know no steepest slope, check it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.reference import boundary

from . import crossed, rayleigh
from .cases import index_of
from .light import direction
from .patches import SURFACES, PatchCase, cell, patch_cases
from .solutions import DATA, Work, load_rows

#: A row is one order (mx, my) of one case: wavelength in nm, angles in degrees, `surface` the place
#: in `SURFACES`; `jones` as `crossed.Orders` has it; `change` is by how much the efficiency for
#: unpolarised light changed with the resolution.
PATCH_ROW = np.dtype(
    [
        ("surface", "i1"),
        ("wavelength", "f4"),
        ("theta", "f4"),
        ("phi", "f4"),
        ("mx", "i2"),
        ("my", "i2"),
        ("jones", "c8", (2, 2)),
        ("change", "f4"),
    ]
)

_NAMES = list(SURFACES)

SOLVERS: dict[str, ModuleType] = {"coupled_wave": crossed, "rayleigh": rayleigh}

#: What the solvers take after the direction of light, first and finally: of gratings, and of cells.
#: Harmonics and layers; harmonics.
RESOLUTIONS: dict[str, tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]] = {
    "coupled_wave": (((41, 12), (61, 24)), ((101, 8), (165, 14))),
    "rayleigh": (((41,), (61,)), ((709,), (999,))),
}


@dataclass(frozen=True)
class Solved:
    """Solution of a case: rows (n,) of `PATCH_ROW`."""

    case: PatchCase
    rows: NDArray[np.void]

    @property
    def wi(self) -> NDArray[np.float64]:
        """Unit vector to the light, (3,)."""
        return direction(self.case.theta, self.case.phi)

    def wo(self, field: HeightField) -> NDArray[np.float64]:
        """Directions of the orders, (n, 3)."""
        numbers = np.stack([self.rows["mx"], self.rows["my"]], axis=1)
        tangential = self.case.wavelength / 1000 * numbers / field.extent - self.wi[:2]
        upward = np.sqrt(1 - np.sum(tangential**2, axis=1))
        return np.column_stack([tangential, upward])

    def efficiency(self, field: HeightField) -> NDArray[np.float64]:
        """Efficiencies of the orders for unpolarised light, (n,)."""
        power = boundary.unpolarised(self.rows["jones"])
        return power * self.wo(field)[:, 2] / self.wi[2]


def file_of(material: str, solver: str) -> str:
    """Name of the file of a material's solutions by a solver, without its suffix."""
    return f"{material}_patches_{solver}"


def work(material: str, solver: str) -> Work:
    """Return all cases of a material, by Rayleigh's expansion or coupled waves."""
    about = {
        "solver": SOLVERS[solver].name(),
        "material": material,
        "surfaces": _NAMES,
        "resolutions of gratings and of cells": RESOLUTIONS[solver],
    }
    file = file_of(material, solver)
    return Work(list(patch_cases(material)), partial(_by_file, file, solver), {file: about})


def _by_file(file: str, solver: str, case: PatchCase) -> dict[str, NDArray[np.void]]:
    return {file: solve_case(case, solver)}


def solve_case(case: PatchCase, solver: str) -> NDArray[np.void]:
    """Rows of one case, by one of `SOLVERS` at two resolutions."""
    field = cell(case.surface)
    index = index_of(case.material, case.wavelength)
    solved = Solved(case, np.empty(0, PATCH_ROW))
    coarse, fine = (
        SOLVERS[solver].solve(field, index, case.wavelength, solved.wi, *resolution)
        for resolution in RESOLUTIONS[solver][int(crossed.is_crossed(field))]
    )
    rows = np.zeros(len(fine.order), PATCH_ROW)
    rows["surface"] = _NAMES.index(case.surface.name)
    rows["wavelength"], rows["theta"], rows["phi"] = case.wavelength, case.theta, case.phi
    rows["mx"], rows["my"] = fine.order.T
    rows["jones"] = fine.jones
    before = {tuple(key): power for key, power in zip(coarse.order, _powers(coarse), strict=True)}
    powers = zip(fine.order, _powers(fine), strict=True)
    ratio = fine.wo[:, 2] / solved.wi[2]
    changes = [abs(power - before.get(tuple(key), 0.0)) for key, power in powers]
    rows["change"] = np.array(changes) * ratio
    return rows


def solved(material: str, solver: str = "rayleigh") -> tuple[list[Solved], Mapping[str, Any]]:
    """Stored solutions, case by case, and the description of their solver."""
    rows, description = load_rows(DATA / f"{file_of(material, solver)}.npz", PATCH_ROW)
    return list(_cases_of(rows, material)), description


def _cases_of(rows: NDArray[np.void], material: str) -> Iterator[Solved]:
    key = ["surface", "wavelength", "theta", "phi"]
    unique, inverse = np.unique(rows[key], return_inverse=True)
    for n, (surface, wavelength, theta, phi) in enumerate(unique.tolist()):
        case = PatchCase(SURFACES[_NAMES[surface]], material, wavelength, theta, phi)
        yield Solved(case, rows[inverse.ravel() == n])


def _powers(orders: crossed.Orders) -> NDArray[np.float64]:
    return boundary.unpolarised(orders.jones)
