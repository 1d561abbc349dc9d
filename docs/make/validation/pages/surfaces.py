"""docs/validation/surfaces.md: cells in two dimensions, in any plane of incidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..compare import Sides
from ..models import ANGLES, BOTH, COMPARED, of_cells
from ..solutions import LIGHTS
from .markdown import angle, percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    cells = measured.cells
    header = ["surface", "RMS slope", "nm", *map(angle, ANGLES), "change"]
    return f"""# Surfaces in two dimensions

Deviation of colours on small periodic cells: sinusoids in conical mounts, a crossed grating, and
cuts of 2.6 µm of a measured scale (*Elaphe*), of its look-alike, and of 3.2 µm of a CD. The cuts
are made periodic, smoothed and scaled to an RMS slope. The solver is Rayleigh's expansion, which
does not converge on steeper metals.

## Unpolarised light

Mean over the planes of incidence, as Kirchhoff / small slope alone / the default. *Change* is the
largest change of the solution by more harmonics.

{table(header, list(_unpolarised(cells)))}

## Polarised light

Light from 60°, mean over the planes of incidence, as Kirchhoff / the default.

{table(["surface", "nm", "s", "p"], list(_polarised(cells)))}"""


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
