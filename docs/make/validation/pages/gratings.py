"""docs/validation/gratings.md: gratings of keratin and aluminium."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from mitsuba_diffraction.heights import GENTLE_SLOPE, STEEP_SLOPE

from .. import goals, models
from ..cases import Grating
from ..compare import Comparison, angles_of, gratings_of, table_of
from ..limits import GENTLE_ERROR, STEEP_ERROR, STEEPEST_LIGHT, slope_limit
from .markdown import angle, beside, percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    parts = [_introduction(), _bands(measured), _slopes(measured), _edges(measured)]
    return "\n\n".join([*parts, _aluminium(measured), _goals(measured)])


def _introduction() -> str:
    return """# Gratings of keratin and aluminium

Deviation of colours of three models from rigorous solutions
([method](solutions.md), [definition](../validation.md#what-the-figures-are)):

- *Kirchhoff*: `model="kirchhoff"`.
- *Small slope*: first-order small slope alone, which the plugin does not offer.
- *Blend*: `model="small_slope"`.

Light is incident across the grooves."""


def _bands(measured: Measurements) -> str:
    return f"""## By depth and profile

Mean over the gratings, as Kirchhoff / small slope / blend.

{_banded(measured, ("kirchhoff", "small_slope_alone", "small_slope"), {"": models.of_colours})}

For one polarisation, whose errors partly cancel in unpolarised light, as Kirchhoff / blend (TE: the
electric field along the grooves):

{_banded(measured, ("kirchhoff", "small_slope"), {"TE ": models.of_te, "TM ": models.of_tm})}"""


def _banded(
    measured: Measurements,
    names: Sequence[str],
    measures: Mapping[str, Callable[[Comparison], float]],
) -> str:
    """Table of deviations by models, for each material, profile and range of depth/period."""
    rows = []
    for material in models.MATERIALS:
        parts = [measured.by_model[material, name] for name in names]
        columns = [
            [list(models.banded(part, models.ANGLES, measure)) for part in parts]
            for measure in measures.values()
        ]
        for n, (profile, (low, high), _) in enumerate(columns[0][0]):
            cells = [c for by_model in columns for c in beside(*(part[n][2] for part in by_model))]
            rows.append([f"{material}, {profile}", f"{low:g} to {high:g}", *cells])
    header = [f"{light}{angle(theta)}" for light in measures for theta in models.ANGLES]
    return table(["grating", "depth/period", *header], rows)


def _slopes(measured: Measurements) -> str:
    kirchhoff, default = measured.kirchhoff, measured.default
    rows = [
        [
            f"{material}, {grating.period:g}/{grating.depth:g} µm",
            f"{grating.field.rms_slope:.3f}",
            *_side_by_side(kirchhoff[material], default[material], grating, models.ANGLES),
        ]
        for material in default
        for grating in sorted(
            gratings_of(default[material], "sinusoidal"), key=lambda g: g.field.rms_slope
        )
    ]
    header = ["sinusoid", "RMS slope", *map(angle, models.ANGLES)]
    parts = list(default.values())
    gentle, steep = (slope_limit(parts, error) for error in (GENTLE_ERROR, STEEP_ERROR))
    return f"""## Sinusoids by slope

Period/depth, Kirchhoff / blend:

{table(header, rows)}

The package warns beyond {GENTLE_SLOPE:g} and {STEEP_SLOPE:g}. Up to {gentle:.3f} and {steep:.3f}
no sinusoid of either material exceeds {percent(GENTLE_ERROR)} and {percent(STEEP_ERROR)}
in light up to {STEEPEST_LIGHT:g}° from the normal. The RMS slope of steps depends on the pixel, so
it says little about blazed and lamellar gratings."""


def _edges(measured: Measurements) -> str:
    parts = [
        """## Walls

The model ignores light reflected by vertical walls. Period/depth, Kirchhoff / blend. On blazed
gratings, light from positive angles is incident on the steps, light from negative angles on the
facets."""
    ]
    for profile in ("lamellar", "blazed"):
        angles = angles_of(measured.default["keratin"].where(profile=profile))
        rows = [
            [
                f"{material}, {grating.period:g}/{grating.depth:g} µm",
                *_side_by_side(measured.kirchhoff[material], part, grating, angles),
            ]
            for material, part in measured.default.items()
            for grating in gratings_of(part, profile)
        ]
        header = [profile.capitalize(), *map(angle, angles)]
        parts.append(table(header, rows))
    return "\n\n".join(parts)


def _aluminium(measured: Measurements) -> str:
    by_model = goals.with_half(measured.by_model, "aluminium")
    every = goals.singles(by_model)
    better, worse = ([c for c in every if sign * c.gain > c.change] for sign in (1, -1))
    rows = []
    for case in [*(c for c in goals.whole_bands(by_model) if -c.gain > c.change), *worse]:
        share, best = case.with_one_share()
        pair = case.deviation("kirchhoff"), case.deviation("small_slope")
        values = [f"{100 * x:.2f} %" for x in (*pair, case.change, best, case.with_any_shares())]
        rows.append([case.label, angle(case.theta), *values[:3], f"{share:.2f}", *values[3:]])
    header = ["", "light from", "Kirchhoff", "blend", "change", "best share", "with it", "bound"]
    gains = [100 * case.gain for case in every]
    return f"""## Aluminium: blend against Kirchhoff

Of {len(every)} gratings and angles the blend is better in {len(better)}, at best by
{max(gains):.1f} points, and worse in {len(worse)}, at most by {-min(gains):.2f} points.
Differences below the last refinement of the solver (*change*) do not count. Worse on average:

{table(header, rows)}

*Best share* is the share of small slope, equal for all orders, with the least deviation; *bound* is
the deviation if every order had its own. Where the best share is 0, Kirchhoff's errors cancel: both
matrices lack light that is diffracted twice, and Kirchhoff's is brighter."""


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
    names = ["goal", "Kirchhoff", "default"]
    return f"""## Goals

Light from 60°, on cuts of scales also from 0° and 30°:

{table(["surface", *names], rows)}

On keratin {len(worse)} gratings and angles are worse than Kirchhoff by more than a tenth (goal:
0)."""


def _reached(deviation: float, goal: float) -> str:
    missed = "" if deviation <= goal else "**missed:** "
    return f"{missed}{percent(deviation)}"


def _side_by_side(
    first: Comparison, second: Comparison, grating: Grating, angles: Sequence[float]
) -> list[str]:
    """Deviations of colours by both comparisons, a cell for each angle."""
    columns = (table_of(part, [grating], angles, models.of_colours)[0] for part in (first, second))
    return beside(*columns)
