"""Parts of docs/validation/surfaces.md: cells in two dimensions, in any plane of incidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..compare import Sides
from ..models import ANGLES, BOTH, COMPARED, of_cells
from ..solutions import LIGHTS
from .markdown import angle, percent, table
from .measurements import Measurements


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    header = ["surface", "RMS slope", "nm", *map(angle, ANGLES), "change"]
    return {
        "unpolarised-light": table(header, list(_unpolarised(measured.cells))),
        "polarised-light": table(["surface", "nm", "s", "p"], list(_polarised(measured.cells))),
    }


def _unpolarised(cells: Mapping[str, Sides]) -> Iterator[list[object]]:
    for start, sides in _by_surface(cells):
        kirchhoff = sides["kirchhoff"]
        slope = f"{kirchhoff.solved[0].case.surface.slope:.2g}"
        values = [_means(sides, COMPARED, theta=theta) for theta in ANGLES]
        change = percent(max(part.change() for part in kirchhoff.each()))
        yield [start[0], slope, start[1], *values, change]


def _polarised(cells: Mapping[str, Sides]) -> Iterator[list[object]]:
    for start, sides in _by_surface(cells):
        yield [*start, *(_means(sides, BOTH, light, theta=60.0) for light in LIGHTS)]


def _by_surface(cells: Mapping[str, Sides]) -> Iterator[tuple[tuple[str, str], Sides]]:
    """Name and wavelength, and the comparisons by model, of each material's surfaces."""
    for material, sides in cells.items():
        cases = [solved.case for solved in sides["kirchhoff"].solved]
        for surface, lam in dict.fromkeys((case.surface, case.light.wavelength) for case in cases):
            parts = {m: every.where(surface=surface, wavelength=lam) for m, every in sides.items()}
            yield (f"{material}, {surface}", f"{lam:g}"), parts


def _means(sides: Sides, models: Sequence[str], light: str | None = None, **chosen: Any) -> str:
    """Means over the planes of incidence by model."""
    by_model = [of_cells(sides[model], light, **chosen) for model in models]
    return " / ".join(percent(float(np.mean(v))) for v in by_model) if by_model[0] else "–"
