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
from .compare import Sides
from .models import by_model
from .solutions import Solutions, Solved

#: Sinusoids whose steepest slopes are 0.03, 0.06, 0.1, 0.1 and 0.2.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035), (1.6, 0.1))
)
ANGLES = (0.0, 30.0, 60.0, 75.0)
#: Azimuths of the light: across the grooves, between, along.
AZIMUTHS = (0.0, 35.0, 90.0)
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


def compared(chosen: Sequence[Grating] = GRATINGS) -> Sides:
    """Compare both models on gratings in light of two wavelengths from above."""
    lights = list(itertools.product(FEW_WAVELENGTHS, ANGLES, AZIMUTHS))
    solved = []
    for case in (Case(grating, Light(*light), _THROUGH) for grating in chosen for light in lights):
        orders = rayleigh.solve(case, _HARMONICS)
        solved.append(Solved.between(case, orders, orders))
    return by_model(Solutions(solved))


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
    for recipe in recipes:
        source = TableSource.of(recipe)
        yield from _sums(recipe.stem, source.table(source.settings_for({})))


def _sums(name: str, table: DiffractionTable) -> Iterator[Sums]:
    for medium, summary in sides_summary(table).items():
        for side in ("above", "below"):
            spans = (summary[f"R + T{kind}, from {side}"] for kind in ("", ", conserved"))
            yield Sums(name, medium.split(" ")[0], side, *spans)
