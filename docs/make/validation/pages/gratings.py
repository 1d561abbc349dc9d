"""Parts of docs/validation/gratings.md: gratings of keratin and aluminium."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from mitsuba_diffraction.heights import GENTLE_SLOPE, STEEP_SLOPE

from .. import goals, models
from ..compare import Comparison, angles_of, gratings_of
from ..limits import GENTLE_ERROR, STEEP_ERROR, STEEPEST_LIGHT, slope_limit
from .markdown import angle, beside, both_models, percent, table
from .measurements import Measurements


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    by_light = {"TE ": models.of_te, "TM ": models.of_tm}
    return {
        "by-depth-and-profile": _banded(measured, models.COMPARED, {"": models.of_colours}),
        "by-depth-and-profile-2": _banded(measured, models.BOTH, by_light),
        **_slopes(measured),
        "walls": _edges(measured, "lamellar"),
        "walls-2": _edges(measured, "blazed"),
        **_aluminium(measured),
        "goals": _goals(measured),
        "worse": f"{len(goals.much_worse(measured.gratings['keratin']))}",
    }


def _banded(
    measured: Measurements,
    names: Sequence[str],
    measures: Mapping[str, Callable[[Comparison], float]],
) -> str:
    """Table of deviations by models, for each material, profile and range of depth/period."""
    rows = []
    for material in models.MATERIALS:
        parts = [measured.gratings[material][name] for name in names]
        columns = [
            [list(models.banded(part, models.ANGLES, measure)) for part in parts]
            for measure in measures.values()
        ]
        for n, (profile, (low, high), _) in enumerate(columns[0][0]):
            cells = [c for by_model in columns for c in beside(*(part[n][2] for part in by_model))]
            rows.append([f"{material}, {profile}", f"{low:g} to {high:g}", *cells])
    header = [f"{light}{angle(theta)}" for light in measures for theta in models.ANGLES]
    return table(["grating", "depth/period", *header], rows)


def _slopes(measured: Measurements) -> dict[str, str]:
    rows = [
        [
            f"{material}, {grating.period:g}/{grating.depth:g} µm",
            f"{grating.field.rms_slope:.3f}",
            *both_models(sides, grating, models.ANGLES),
        ]
        for material, sides in measured.gratings.items()
        for grating in sorted(
            gratings_of(sides["small_slope"], "sinusoidal"), key=lambda g: g.field.rms_slope
        )
    ]
    header = ["sinusoid", "RMS slope", *map(angle, models.ANGLES)]
    sides = list(measured.default.values())
    gentle, steep = (slope_limit(sides, error) for error in (GENTLE_ERROR, STEEP_ERROR))
    return {
        "sinusoids-by-slope": table(header, rows),
        "warned": f"{GENTLE_SLOPE:g} and {STEEP_SLOPE:g}",
        "limits": f"Up to {gentle:.3f} and {steep:.3f} no sinusoid of either material exceeds "
        f"{percent(GENTLE_ERROR)} and {percent(STEEP_ERROR)} in light up to {STEEPEST_LIGHT:g}°",
    }


def _edges(measured: Measurements, profile: str) -> str:
    angles = angles_of(measured.default["keratin"].where(profile=profile))
    rows = [
        [
            f"{material}, {grating.period:g}/{grating.depth:g} µm",
            *both_models(sides, grating, angles),
        ]
        for material, sides in measured.gratings.items()
        for grating in gratings_of(sides["small_slope"], profile)
    ]
    return table([profile.capitalize(), *map(angle, angles)], rows)


def _aluminium(measured: Measurements) -> dict[str, str]:
    sides = goals.with_half(measured.gratings["aluminium"])
    every = goals.singles(sides)
    better, worse = ([c for c in every if sign * c.gain > c.change] for sign in (1, -1))
    rows = []
    for case in [*(c for c in goals.whole_bands(sides) if -c.gain > c.change), *worse]:
        share, best = case.with_one_share()
        pair = case.deviation("kirchhoff"), case.deviation("small_slope")
        values = [f"{100 * x:.2f} %" for x in (*pair, case.change, best, case.with_any_shares())]
        rows.append([case.label, angle(case.theta), *values[:3], f"{share:.2f}", *values[3:]])
    header = ["", "light from", "Kirchhoff", "blend", "change", "best share", "with it", "bound"]
    gains = [100 * case.gain for case in every]
    return {
        "tally": f"{len(every)} gratings and angles the blend is better in {len(better)}, at best "
        f"by {max(gains):.1f} points, and worse in {len(worse)}, at most by {-min(gains):.2f} "
        "points",
        "aluminium-blend-against-kirchhoff": table(header, rows),
    }


def _goals(measured: Measurements) -> str:
    rows = [
        [
            f"keratin, {goal.profile}, depth/period {goal.band[0]:g} to {goal.band[1]:g}",
            *map(percent, (goal.goal, goal.kirchhoff)),
            _reached(goal.default, goal.goal),
        ]
        for goal in goals.keratin_goals(measured.gratings["keratin"])
    ]
    cells, scales = measured.cells["keratin"], ["elaphe", "elaphe_like"]
    cuts = [models.of_cells(cells[model], kind=scales, slope=0.2) for model in models.BOTH]
    for name, most, measure in (("mean", 0.07, np.mean), ("worst", 0.1, np.max)):
        if cuts[0]:
            kirchhoff, default = (float(measure(deviations)) for deviations in cuts)
            reached = [percent(most), percent(kirchhoff), _reached(default, most)]
            rows.append([f"keratin, cuts of scales, slope 0.2, 0° to 60°, {name}", *reached])
    return table(["surface", "goal", "Kirchhoff", "default"], rows)


def _reached(deviation: float, goal: float) -> str:
    missed = "" if deviation <= goal else "**missed:** "
    return f"{missed}{percent(deviation)}"
