"""Transmitted orders of thin sheets, model and solution: docs/orders.md.

python -m docs.make.figures.sheets
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np

from docs.make.validation.cases import Case, Light, Media, Sampled
from docs.make.validation.compare import misplaced
from docs.make.validation.light import heights_of, solved_by
from docs.make.validation.model import modelled
from mitsuba_diffraction.orders.solve import IntegralSolver
from mitsuba_diffraction.orders.solve.profiles import Profile, sinusoidal

from . import pages
from .pages import option, program

_MEDIA = Media(1.58, through=True, thin=True)
_NM, _THETAS, _PHIS = (460.0, 610.0), (0.0, 30.0, 60.0), (0.0, 60.0)


class Sheet(NamedTuple):
    """Sheet, and the points of its solution, which 1.4 times as many change by 0.1 % at most."""

    title: str
    profile: Profile
    points: int


SHEETS = (
    Sheet("250 lines/mm, 0.22 µm (`film.xml`)", sinusoidal(4.0, 0.22), 200),
    Sheet("600 lines/mm, 0.09 µm (`spectrometer.xml`)", sinusoidal(1.6667, 0.09), 120),
    Sheet("1000 lines/mm, 0.3 µm", sinusoidal(1.0, 0.3), 120),
)


def row(sheet: Sheet) -> tuple[str, ...]:
    """Return the cells of a sheet: mean misplaced share of the transmitted orders, by angle."""
    surface, shares = Sampled(heights_of(sheet.profile)), []
    solver = IntegralSolver(sheet.profile, sheet.points)
    for theta in _THETAS:
        lights = [Light(lam, theta, phi) for phi in (_PHIS if theta else (0.0,)) for lam in _NM]
        missed = [_missed(solver, Case(surface, light, _MEDIA)) for light in lights]
        shares.append(f"{np.mean(missed):.0%}")
    return (sheet.title, *shares)


def _missed(solver: IntegralSolver, case: Case) -> float:
    """Return Σ|model − solution| over Σ solution, of the transmitted orders but 0."""
    solved = solved_by(solver, case)
    values = modelled(case, solved.order, "small_slope")
    sides = (part.mean(axis=1) for part in (values, solved.powers))
    return misplaced(*sides, solved.order[:, 0] != 0)


@program(option("-o", "--output", type=Path, default=Path("docs"), help="of the page"))
def main(args: argparse.Namespace) -> None:
    """Write the table of the page."""
    header = ("sinusoidal sheet of index 1.58", *(f"{theta:g}°" for theta in _THETAS))
    table = pages.table(header, [row(sheet) for sheet in SHEETS])
    pages.update(args.output / "orders.md", {"sheets": table})
