"""Transmitted orders of dielectric gratings beside Rayleigh's expansion, and R + T of surfaces.

Rayleigh's expansion takes a fraction of a second a grating, so the solutions
are computed with the page and not stored.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from mitsuba_diffraction import DiffractionTable, TableSource, gratings
from mitsuba_diffraction.analysis.energy import sides_summary

from . import rayleigh
from .cases import FEW_WAVELENGTHS, Case, Grating, Light, Media
from .compare import compare
from .models import of_colours
from .solutions import Solutions, Solved

#: Sinusoids whose steepest slopes are 0.03, 0.06, 0.1, 0.1 and 0.2.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035), (1.6, 0.1))
)
ANGLES = (0.0, 30.0, 60.0, 75.0)
#: Azimuths of the light: across the grooves, between, along.
AZIMUTHS = (0.0, 35.0, 90.0)
MODELS = ("kirchhoff", "small_slope")
#: Surfaces whose R + T is summed, by name.
SURFACES = {
    "sinusoid 2.5/0.08 µm": partial(gratings.sinusoidal, 2.5, 0.08, periods=8),
    "sinusoid 1.6/0.1 µm": partial(gratings.sinusoidal, 1.6, 0.1, periods=8),
    "CD": gratings.cd,
    "elaphe_like": gratings.elaphe_like,
    "blazed 2/0.2 µm": partial(gratings.blazed, 2.0, 0.2),
}
#: Recipes that come with the package.
PRECOMPUTE = sorted((Path(__file__).parents[3] / "precompute").glob("*.toml"))
#: Index of the surfaces and recipes.
INDEX = 1.5
_HARMONICS = 31
_THROUGH = Media("keratin", through=True)


class Deviations(NamedTuple):
    """Deviations of colours on a grating at one azimuth, by model and then at `ANGLES`."""

    grating: Grating
    azimuth: float
    by_model: list[list[float]]


def deviations(chosen: Sequence[Grating] = GRATINGS) -> list[Deviations]:
    """Compare both models on gratings at all `AZIMUTHS`, in light of two wavelengths from above."""
    compared = []
    for grating in chosen:
        cases = itertools.product(FEW_WAVELENGTHS, ANGLES, AZIMUTHS)
        solved = Solutions([_solved(Case(grating, Light(*light), _THROUGH)) for light in cases])
        sides = [compare(solved, model) for model in MODELS]
        for phi in AZIMUTHS:
            values = [[of_colours(s.where(theta=t, phi=phi)) for t in ANGLES] for s in sides]
            compared.append(Deviations(grating, phi, values))
    return compared


def _solved(case: Case) -> Solved:
    orders = rayleigh.solve(case, _HARMONICS)
    return Solved.between(case, orders, orders)


class Sums(NamedTuple):
    """Least and largest R + T by angle of incidence, by the model and with energy conserved."""

    surface: str
    medium: str
    side: str
    model: dict[str, list[float]]
    conserved: dict[str, list[float]]


def sums_of_surfaces(names: Sequence[str] = tuple(SURFACES)) -> Iterator[Sums]:
    """R + T of `SURFACES` with a coherence width of 20 µm."""
    for name in names:
        table = DiffractionTable.build(
            SURFACES[name](), coherence_width=20.0, height_scale_max=INDEX
        )
        yield from _sums(name, table)


def sums_of_recipes(recipes: Sequence[Path] = tuple(PRECOMPUTE)) -> Iterator[Sums]:
    """R + T of recipes with their own coherence widths."""
    for source in map(TableSource.of, recipes):
        yield from _sums(source.files[0].stem, source.table(source.settings_for({})))


def _sums(name: str, table: DiffractionTable) -> Iterator[Sums]:
    for medium, summary in sides_summary(table).items():
        for side in ("above", "below"):
            spans = (summary[f"R + T{kind}, from {side}"] for kind in ("", ", conserved"))
            yield Sums(name, medium.split(" ")[0], side, *spans)
