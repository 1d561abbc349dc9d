"""Transmitted orders of thin sheets, model and solution: docs/orders.md.

python -m docs.make.figures.sheets
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np

from docs.make.validation.cases import direction
from docs.make.validation.compare import misplaced
from docs.make.validation.light import heights_of, light_of
from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.orders import solve
from mitsuba_diffraction.orders.solve.profiles import Profile, sinusoidal

from . import pages
from .pages import option, program

_INDEX, _WIDTH = 1.58, 65.0
_WAVELENGTHS, _THETAS, _PHIS = (460.0, 610.0), (0.0, 30.0, 60.0), (0.0, 60.0)


class Case(NamedTuple):
    """Sheet, and the points of its solution, which 1.4 times as many change by 0.1 % at most."""

    title: str
    profile: Profile
    points: int


CASES = (
    Case("250 lines/mm, 0.22 µm (`film.xml`)", sinusoidal(4.0, 0.22), 200),
    Case("600 lines/mm, 0.09 µm (`spectrometer.xml`)", sinusoidal(1.6667, 0.09), 120),
    Case("1000 lines/mm, 0.3 µm", sinusoidal(1.0, 0.3), 120),
)


def row(case: Case) -> tuple[str, ...]:
    """Return the cells of a case: mean misplaced share of the transmitted orders, by angle."""
    cells_of = []
    for theta in _THETAS:
        missed = [
            _missed(case, theta, phi, lam)
            for phi in (_PHIS if theta else (0.0,))
            for lam in _WAVELENGTHS
        ]
        cells_of.append(f"{np.mean(missed):.0%}")
    return (case.title, *cells_of)


def _missed(case: Case, theta: float, phi: float, wavelength: float) -> float:
    """Return Σ|model − solution| over Σ solution, of the transmitted orders but 0."""
    wi, period = direction(theta, phi), case.profile.period
    station, channel = light_of(period, 1e-3 * wavelength, _INDEX, -wi[0], -wi[1], thin=True)
    amplitudes = solve.IntegralSolver(case.profile, case.points).amplitudes(station)
    powers = solve.sheet_efficiencies(amplitudes, station)[0, channel]
    solved = powers[:, station.channels :].mean(axis=0).sum(axis=-1)
    orders = channel - np.arange(station.channels)
    x = orders * wavelength / (1e3 * period) - wi[0]
    y = np.full(len(x), -wi[1])
    wo = np.stack([x, y, -np.sqrt(1.0 - x**2 - y**2)], axis=-1)
    # the power of a lobe from the value at its centre
    width = sigma_of(_WIDTH) * 2e3 * np.pi / wavelength
    values = reference.btdf(
        heights_of(case.profile, 64, 4), np.tile(wi, (len(wo), 1)), wo, wavelength,
        eta=_INDEX, thin=True, coherence_width=_WIDTH,
    )  # fmt: skip
    others = orders != 0
    return misplaced(values * np.pi / width**2, solved, others)


@program(option("-o", "--output", type=Path, default=Path("docs"), help="of the page"))
def main(args: argparse.Namespace) -> None:
    """Write the table of the page."""
    header = ("sinusoidal sheet of index 1.58", *(f"{theta:g}°" for theta in _THETAS))
    text = pages.table(header, [row(case) for case in CASES])
    text += "\n\n`python -m docs.make.figures.sheets` makes this table."
    pages.update(args.output / "orders.md", {"sheets": text})
