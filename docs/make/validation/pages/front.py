"""Parts of docs/validation.md: the figures that users decide by."""

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


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    header = ["surface", "cases", "Kirchhoff, 60°", "default, 60°", "0°", "30°"]
    gentle = gratings_of(measured.coats[0], "sinusoidal")
    tables = (table_of(part, gentle, ANGLES, of_colours) for part in measured.coats)
    passage, bounced = (percent(float(values.max())) for values in tables)
    return {
        "slopes": f"up to an RMS slope of {GENTLE_SLOPE:g} colours deviate by less than "
        f"{percent(GENTLE_ERROR)}, up to {STEEP_SLOPE:g} by less than {percent(STEEP_ERROR)}, in "
        f"light up to {STEEPEST_LIGHT:g}°",
        "deviation": table(header, [*_gratings(measured), *_cells(measured)]),
        "grazing": f"{GRAZING:g}°",
        "coat": f"{passage} for light diffracted once, {bounced} with bounces",
        "film": percent(measured.worst_under_films),
    }


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
