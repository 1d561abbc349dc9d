"""docs/validation/surfaces.md: cells in two dimensions, in any plane of incidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..cells import PatchComparison
from .markdown import angle, percent, table
from .measurements import Measurements

_MODELS = ("kirchhoff", "small_slope_alone", "small_slope")
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


def _unpolarised(cells: Sequence[PatchComparison]) -> Iterator[list[str]]:
    for label, same in _by_surface(cells):
        case = same[0].case
        values = []
        for theta in _ANGLES:
            chosen = [c.by_model for c in same if c.case.theta == theta]
            means = [_mean([c[model] for c in chosen]) for model in _MODELS]
            values.append(" / ".join(map(percent, means)) if chosen else "–")
        change = percent(max(c.change for c in same))
        yield [label, f"{case.surface.slope:.2g}", f"{case.wavelength:g}", *values, change]


def _polarised(cells: Sequence[PatchComparison]) -> Iterator[list[str]]:
    for label, same in _by_surface(cells):
        oblique = [c.polarised for c in same if c.case.theta == 60.0]
        means = (
            " / ".join(percent(_mean([c[model][n] for c in oblique])) for model in _POLARISED)
            for n in range(2)
        )
        yield [label, f"{same[0].case.wavelength:g}", *means]


def _by_surface(cells: Sequence[PatchComparison]) -> Iterator[tuple[str, list[PatchComparison]]]:
    """Name and cases of each material, surface and wavelength."""
    groups: dict[tuple[object, ...], list[PatchComparison]] = {}
    for c in cells:
        groups.setdefault((c.case.material, c.case.surface, c.case.wavelength), []).append(c)
    for same in groups.values():
        yield f"{same[0].case.material}, {same[0].case.surface.name}", same


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else np.nan
