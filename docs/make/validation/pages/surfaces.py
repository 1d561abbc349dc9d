"""docs/validation/surfaces.md: cells in two dimensions, in any plane of incidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..cases import Case
from ..compare import Sides
from ..models import COMPARED, of_cells
from ..solutions import LIGHTS
from .markdown import angle, percent, table
from .measurements import Measurements

_MODELS = COMPARED
_POLARISED = ("kirchhoff", "small_slope")
_ANGLES = (0.0, 30.0, 60.0)


def write(measured: Measurements) -> str:
    """Write the page."""
    cells = measured.cells
    header = ["surface", "RMS slope", "nm", *map(angle, _ANGLES), "change"]
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


def _unpolarised(cells: Sides) -> Iterator[list[object]]:
    for label, case, chosen in _by_surface(cells):
        kirchhoff = cells[case.media.material, "kirchhoff"].where(**chosen)
        change = percent(max(part.change() for part in kirchhoff.each()))
        values = [_means(cells, case, _MODELS, theta=theta, **chosen) for theta in _ANGLES]
        cell = case.surface
        yield [label, f"{cell.slope:.2g}", f"{case.light.wavelength:g}", *values, change]


def _polarised(cells: Sides) -> Iterator[list[object]]:
    for label, case, chosen in _by_surface(cells):
        values = [_means(cells, case, _POLARISED, light, theta=60.0, **chosen) for light in LIGHTS]
        yield [label, f"{case.light.wavelength:g}", *values]


def _by_surface(cells: Sides) -> Iterator[tuple[str, Case, dict[str, Any]]]:
    """Name, a case and the values in common of each material, surface and wavelength."""
    cases = [
        s.case for (_, model), part in cells.items() for s in part.solved if model == _MODELS[0]
    ]
    for media, surface, wavelength in dict.fromkeys(
        (case.media, case.surface, case.light.wavelength) for case in cases
    ):
        chosen = {"surface": surface, "wavelength": wavelength}
        case = next(c for c in cases if c.has(media=media, **chosen))
        yield f"{media.material}, {surface}", case, chosen


def _means(
    cells: Sides, case: Case, models: Sequence[str], light: str | None = None, **chosen: Any
) -> str:
    """Means over the planes of incidence by model."""
    by_model = [of_cells(cells[case.media.material, model], light, **chosen) for model in models]
    return " / ".join(percent(float(np.mean(v))) for v in by_model) if by_model[0] else "–"
