"""docs/validation.md: the figures that users decide by."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.heights import GENTLE_SLOPE, STEEP_SLOPE

from ..compare import GRAZING, gratings_of, table_of
from ..limits import GENTLE_ERROR, STEEP_ERROR, STEEPEST_LIGHT
from ..models import ANGLES, BOTH, of_cells, of_colours
from .markdown import percent, table
from .measurements import Measurements

#: Kinds of cells in two dimensions: name in the table, kinds of `patches.KINDS`, slope, material.
_CELLS = (
    ("keratin, cuts of scales, slope 0.2", ["elaphe", "elaphe_like"], 0.2, "keratin"),
    ("keratin, cuts of scales, slope 0.09", ["elaphe", "elaphe_like"], 0.09, "keratin"),
    ("keratin, CD's pits, slope 0.2", ["cd_pits"], 0.2, "keratin"),
    ("keratin, CD's pits, slope 0.06", ["cd_pits"], 0.06, "keratin"),
    ("aluminium, cuts of scales, slope 0.09", ["elaphe", "elaphe_like"], 0.09, "aluminium"),
    ("aluminium, CD's pits, slope 0.06", ["cd_pits"], 0.06, "aluminium"),
)
#: Largest depth/period of walls that count as low.
_LOW = 0.08


def write(measured: Measurements) -> str:
    """Write the page."""
    parts = [_surfaces(measured), _layers(measured), _numerics(), _tables()]
    return "\n\n".join(parts)


def _surfaces(measured: Measurements) -> str:
    rows = [*_gratings(measured), *_cells(measured)]
    header = ["surface", "cases", "Kirchhoff, 60°", "default, 60°", "0°", "30°"]
    return f"""# How far the model holds

`make validation` compares the model with rigorous solutions, closed forms and statistics, and
writes these pages.

- Gentle surfaces: up to an RMS slope of {GENTLE_SLOPE:g} colours deviate by less than
  {percent(GENTLE_ERROR)}, up to {STEEP_SLOPE:g} by less than {percent(STEEP_ERROR)}, in light up to
  {STEEPEST_LIGHT:g}° from the normal. The package warns beyond both slopes.
- Vertical walls deviate more at any depth, most of all on metals and in oblique light. For
  periodic grooves, [solved orders](validation/orders.md) have no such error.
- `model="small_slope"`, the default, is better than `model="kirchhoff"`, most of all in oblique
  light and in polarised light.
- The model ignores light that is diffracted twice. The error is largest where all structures are
  alike and light is oblique, as on the pits of a dielectric disc.

## Deviation by surface

Mean and worst case for light from 60°; mean of the default for 0° and 30°.

{table(header, rows)}

![Deviation of sinusoids against RMS slope](images/validation_slopes.png)

### What the figures are

The deviation of *colours* is a sum over wavelengths and over the diffracted orders within
{GRAZING:g}° of the normal:

$$
\\frac{{\\sum |\\eta - \\eta_{{\\mathrm{{rigorous}}}}|}}{{\\sum \\eta_{{\\mathrm{{rigorous}}}}}} ,
$$

where η is the power of an order for unpolarised light, before energy is conserved. The index of
keratin is 1.56. Light is incident across the grooves of gratings."""


def _gratings(measured: Measurements) -> list[list[object]]:
    """Rows of sinusoids by slope, and of walls by depth."""
    rows = []
    for material, sides in measured.gratings.items():
        default = sides["small_slope"]
        sinusoids = gratings_of(default, "sinusoidal")
        walls = [g for p in ("lamellar", "blazed") for g in gratings_of(default, p)]
        groups = {
            f"sinusoidal, slope up to {GENTLE_SLOPE:g}": [
                g for g in sinusoids if g.field.rms_slope <= GENTLE_SLOPE
            ],
            f"sinusoidal, slope {GENTLE_SLOPE:g} to {STEEP_SLOPE:g}": [
                g for g in sinusoids if GENTLE_SLOPE < g.field.rms_slope <= STEEP_SLOPE
            ],
            f"walls, depth/period up to {_LOW:g}": [g for g in walls if g.depth <= _LOW * g.period],
            f"walls, depth/period above {_LOW:g}": [g for g in walls if g.depth > _LOW * g.period],
        }
        for name, selected in groups.items():
            if selected:
                values = [table_of(sides[model], selected, ANGLES, of_colours) for model in BOTH]
                oblique = [_mean_and_worst(v[:, 2]) for v in values]
                steeper = [percent(float(np.nanmean(values[1][:, n]))) for n in (0, 1)]
                rows.append([f"{material}, {name}", len(selected), *oblique, *steeper])
    return rows


def _cells(measured: Measurements) -> list[list[object]]:
    rows = []
    for name, kind, slope, material in _CELLS:
        kirchhoff, *default = (
            of_cells(measured.cells[material][model], kind=kind, slope=slope, theta=theta)
            for model, theta in (
                ("kirchhoff", 60.0),
                *(("small_slope", a) for a in (60.0, 0.0, 30.0)),
            )
        )
        if not kirchhoff:
            continue
        columns = [_mean_and_worst(np.array(values)) for values in (kirchhoff, default[0])]
        means = [percent(float(np.mean(values))) if values else "–" for values in default[1:]]
        rows.append([name, len(kirchhoff), *columns, *means])
    return rows


def _mean_and_worst(values: np.ndarray) -> str:
    return f"{percent(float(np.nanmean(values)))}, {percent(float(np.nanmax(values)))}"


def _layers(measured: Measurements) -> str:
    gentle = gratings_of(measured.coats[0], "sinusoidal")
    tables = (table_of(part, gentle, ANGLES, of_colours) for part in measured.coats)
    passage, bounced = (percent(float(values.max())) for values in tables)
    return f"""## Coats, films, transmitted light

Largest deviation of colours in light up to 60°:

- coat on sinusoids of aluminium: {passage} for light diffracted once, {bounced} with bounces.
- film of up to 700 nm on slopes up to 0.1: {percent(measured.worst_under_films)}."""


def _numerics() -> str:
    return """## Numerical errors

Order powers of ideal gratings agree with closed forms to 5e-6 in `md.reference.brdf` and to 1e-5 in
tables. The rigorous solutions change by less than 5e-3 of the incident light in their last
refinement, most by 1e-5."""


def _tables() -> str:
    return """## The tables

- [Gratings](validation/gratings.md) by slope, depth, profile and polarisation, with our goals
- [Surfaces](validation/surfaces.md): crossed gratings, scales and discs, in any plane of incidence
- [Coats and films](validation/layers.md)
- [Transmission](validation/transmission.md): interfaces and thin sheets, and R + T
- [Solved orders](validation/orders.md) beside other solvers and published figures
- [Measured gratings](validation/measured.md) beside the model and solved orders
- [Perfect conductor](validation/conductor.md)
- [Closed forms and random surfaces](validation/numerics.md)
- [Rigorous solutions](validation/solutions.md) and their convergence
- [Scans](validation/scans.md): hues of gratings, and crops of a rough surface"""
