"""docs/validation.md: the figures that users decide by."""

from __future__ import annotations

import numpy as np

from mitsuba_diffraction.heights.validity import GENTLE_SLOPE, STEEP_SLOPE

from .. import goals
from ..compare import GRAZING, gratings_of, table_of
from ..limits import GENTLE_ERROR, STEEP_ERROR, STEEPEST_LIGHT, rms_slope
from ..models import ANGLES, of_colours
from .markdown import percent, table
from .measurements import Measurements

#: Kinds of cells in two dimensions: name in the table, kinds of `patches.KINDS`, slope, material.
_CELLS = (
    ("keratin, cuts of scales, slope 0.2", ("elaphe", "elaphe_like"), 0.2, "keratin"),
    ("keratin, cuts of scales, slope 0.09", ("elaphe", "elaphe_like"), 0.09, "keratin"),
    ("keratin, CD's pits, slope 0.2", ("cd_pits",), 0.2, "keratin"),
    ("keratin, CD's pits, slope 0.06", ("cd_pits",), 0.06, "keratin"),
    ("aluminium, cuts of scales, slope 0.09", ("elaphe", "elaphe_like"), 0.09, "aluminium"),
    ("aluminium, CD's pits, slope 0.06", ("cd_pits",), 0.06, "aluminium"),
)
#: Largest depth/period of walls that count as low.
_LOW = 0.08


def write(measured: Measurements) -> str:
    """Write the page."""
    parts = [_surfaces(measured), _goals(measured), _layers(measured), _numerics(), _tables()]
    return "\n\n".join(parts)


def _surfaces(measured: Measurements) -> str:
    rows = [*_gratings(measured), *_cells(measured)]
    header = ["surface", "cases", "Kirchhoff, 60°", "default, 60°", "0°", "30°"]
    return f"""# How far the model holds

The model beside rigorous solutions, closed forms and statistics. `make validation` computes every
number.

- Gentle surfaces: up to an RMS slope of {GENTLE_SLOPE:g} colours deviate by less than
  {percent(GENTLE_ERROR)}, up to {STEEP_SLOPE:g} by less than {percent(STEEP_ERROR)}, in light up to
  {STEEPEST_LIGHT:g}° from the normal. The package warns beyond both slopes.
- Vertical walls deviate more at any depth, most of all on metals and in oblique light.
  [Solved orders](validation/orders.md) have no such error, on grooves that repeat along a line.
- `model="small_slope"`, the default, is better than `model="kirchhoff"`, most of all in oblique
  light and in polarised light.
- Light that the surface diffracts twice is left out. That costs most where all structures are alike
  and light is oblique, as on the pits of a dielectric disc.

## Deviation by surface

Light from 60°, mean and worst of the cases; then the default's mean for light from 0° and 30°.

{table(header, rows)}

![Deviation of sinusoids against RMS slope](images/validation_slopes.png)

### What the figures are

The deviation of *colours* is, over the wavelengths and over all orders but order 0 that leave
within {GRAZING:g}° of the normal,

$$
\\frac{{\\sum |\\eta - \\eta_{{\\mathrm{{rigorous}}}}|}}{{\\sum \\eta_{{\\mathrm{{rigorous}}}}}} ,
$$

where η is the power of an order for unpolarised light, before energy is conserved. Keratin has the
index 1.56. Gratings are periodic along x, and light falls across their grooves."""


def _gratings(measured: Measurements) -> list[list[object]]:
    """Rows of sinusoids by slope, and of walls by depth."""
    rows = []
    for material, default in measured.default.items():
        sinusoids = gratings_of(default, "sinusoidal")
        walls = [g for p in ("lamellar", "blazed") for g in gratings_of(default, p)]
        groups = {
            f"sinusoidal, slope up to {GENTLE_SLOPE:g}": [
                g for g in sinusoids if rms_slope(g) <= GENTLE_SLOPE
            ],
            f"sinusoidal, slope {GENTLE_SLOPE:g} to {STEEP_SLOPE:g}": [
                g for g in sinusoids if GENTLE_SLOPE < rms_slope(g) <= STEEP_SLOPE
            ],
            f"walls, depth/period up to {_LOW:g}": [g for g in walls if g.depth <= _LOW * g.period],
            f"walls, depth/period above {_LOW:g}": [g for g in walls if g.depth > _LOW * g.period],
        }
        for name, chosen in groups.items():
            if chosen:
                values = [
                    table_of(measured.by_model[material, model], chosen, ANGLES, of_colours)
                    for model in ("kirchhoff", "small_slope")
                ]
                oblique = [_mean_and_worst(v[:, 2]) for v in values]
                steeper = [percent(float(np.nanmean(values[1][:, n]))) for n in (0, 1)]
                rows.append([f"{material}, {name}", len(chosen), *oblique, *steeper])
    return rows


def _cells(measured: Measurements) -> list[list[object]]:
    rows = []
    for name, kinds, slope, material in _CELLS:
        same = [
            c
            for c in measured.cells
            if c.case.surface.kind in kinds
            and c.case.surface.slope == slope
            and c.case.material == material
        ]
        oblique = [c.by_model for c in same if c.case.theta == 60.0]
        if not oblique:
            continue
        columns = [
            _mean_and_worst(np.array([by_model[model] for by_model in oblique]))
            for model in ("kirchhoff", "small_slope")
        ]
        steeper = [
            [c.by_model["small_slope"] for c in same if c.case.theta == a] for a in (0.0, 30.0)
        ]
        means = [percent(float(np.mean(values))) if values else "–" for values in steeper]
        rows.append([name, len(oblique), *columns, *means])
    return rows


def _mean_and_worst(values: np.ndarray) -> str:
    return f"{percent(float(np.nanmean(values)))}, {percent(float(np.nanmax(values)))}"


def _goals(measured: Measurements) -> str:
    rows = [
        [
            f"keratin, {goal.profile}, depth/period {goal.band[0]:g} to {goal.band[1]:g}",
            *map(percent, (goal.goal, goal.kirchhoff)),
            _reached(goal.default, goal.goal),
        ]
        for goal in goals.keratin_goals(measured.by_model)
    ]
    kirchhoff, default = (
        goals.cuts_of_scales(measured.cells, model) for model in ("kirchhoff", "small_slope")
    )
    for n, (name, most) in enumerate((("mean", 0.07), ("worst", 0.1))):
        if kirchhoff and default:
            cells = [percent(most), percent(kirchhoff[n]), _reached(default[n], most)]
            rows.append([f"keratin, cuts of scales, slope 0.2, 0° to 60°, {name}", *cells])
    worse = goals.much_worse(measured.by_model, "keratin")
    against = goals.against_kirchhoff(measured.by_model, "aluminium")
    least = -100 * min(case.gain for case in against.every)
    names = ["goal", "Kirchhoff", "default"]
    return f"""## Goals

Deviation of colours for light from 60°, and of cuts of scales also from 0° and 30°:

{table(["surface", *names], rows)}

On keratin {len(worse)} gratings and angles are worse than Kirchhoff by more than a tenth (goal: 0).
On aluminium {len(against.better)} of {len(against.every)} are better than Kirchhoff and
{len(against.worse)} worse, at most by {least:.1f} points
([table](validation/gratings.md#aluminium-blend-against-kirchhoff))."""


def _reached(deviation: float, goal: float) -> str:
    missed = "" if deviation <= goal else "**missed:** "
    return f"{missed}{percent(deviation)}"


def _layers(measured: Measurements) -> str:
    gentle = [
        deviation for deviation in measured.coats if deviation.grating.profile == "sinusoidal"
    ]
    coat = (max(getattr(deviation, name) for deviation in gentle) for name in ("single", "bounced"))
    film = max(float(deviation.default.max()) for deviation in measured.films)
    passage, bounced = map(percent, coat)
    rows = [
        ["coat on sinusoids of aluminium, light diffracted once", passage],
        ["coat on sinusoids of aluminium, with bounces", bounced],
        ["film of up to 700 nm on slopes up to 0.1", percent(film)],
    ]
    return f"""## Coats, films, transmitted light

Largest deviation of colours in light up to 60°:

{table(["layer", "worst"], rows)}

[transmission.md](validation/transmission.md) has transmitted orders, and R + T of several
surfaces."""


def _numerics() -> str:
    return """## Numerical errors

Order powers of ideal gratings agree with closed forms to 5e-6 in `md.reference.brdf` and to 1e-5 in
tables ([numerics.md](validation/numerics.md)). The rigorous solutions change by less than 5e-3 of
the incident light in their last refinement, most by 1e-5
([solutions.md](validation/solutions.md))."""


def _tables() -> str:
    rows = [
        ["[gratings](validation/gratings.md)", "by slope, depth, profile and polarisation"],
        ["[surfaces](validation/surfaces.md)", "crossed gratings, scales and discs, any plane"],
        ["[coats and films](validation/layers.md)", "with bounces in the coat, thick films"],
        ["[transmission](validation/transmission.md)", "interfaces and thin sheets; R + T"],
        ["[solved orders](validation/orders.md)", "beside other solvers and print"],
        ["[measured gratings](validation/measured.md)", "model and solved orders beside benches"],
        ["[perfect conductor](validation/conductor.md)", "Kirchhoff's model alone"],
        ["[numerics](validation/numerics.md)", "closed forms, random surfaces"],
        ["[rigorous solutions](validation/solutions.md)", "solvers, convergence, agreement"],
        ["[scans](validation/scans.md)", "hues of scanned gratings, crops of a rough surface"],
    ]
    return f"""## The tables

{table(["page", "holds"], rows).replace("---:", "---")}"""
