"""docs/validation/second_order.md: the second order of small slope, exact and as a factor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import goals, models, second_order_factor
from ..model import DEFAULT
from ..second_order import DEEPEST, MODELS, Case, cases_of_cells, cases_of_gratings
from .markdown import angle, percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    return f"""# The second order of small slope

The factor of `second_order=true` ([equations](../theory.md#the-second-order)) and the exact second
order (Voronovich 1994) beside rigorous solutions.

{_exact(measured)}

{_factor(measured)}

{_gratings(measured)}"""


def _exact(measured: Measurements) -> str:
    cases: list[Case] = []
    for material in models.MATERIALS:
        cases += cases_of_cells(material, measured.kinds)
        cases += [] if measured.quick else cases_of_gratings(material)
    names = ("first order", "times the mean", "second order")
    header = ["surface", "cases", *names, *(f"light, {name}" for name in names)]
    return f"""## The exact second order

Small slope without the blend, summed over all intermediate waves. Deviation of colours, mean and
worst; *light* is all reflected light over the rigorous. *Times the mean* is the first order times
the mean second order of Gaussian heights of the same spectrum. Gratings have a depth/period up to
{DEEPEST:g}.

{table(header, _rows(cases, MODELS, MODELS))}

Most of the first order's error on scales and on a CD is the second order. The mean corrects the
total light on gentle walls but not the colours. On vertical walls the exact sum depends on where it
is truncated."""


def _factor(measured: Measurements) -> str:
    kinds = measured.kinds if not measured.quick else ("elaphe_like",)
    cases = list(second_order_factor.compare_cells(kinds))
    lit = second_order_factor.MODELS[0], second_order_factor.MODELS[2]
    header = ["surface", "cases", *second_order_factor.MODELS, *(f"light, {name}" for name in lit)]
    return f"""## The factor of `second_order=true`

Cuts use the slope ratios of the patch around them, 20 to 65 µm wide; *own orders* uses each order
of the cut. Deviation of colours on keratin, mean and worst, blend included.

{table(header, _rows(cases, second_order_factor.MODELS, lit))}

On a CD in oblique light the factor removes most of the error, because all its pits are alike. On
scales it removes a quarter with each order's own ratios and a tenth with the patch's. It leaves out
evanescent intermediate waves. Metals have no factor: it cannot represent surface plasmons."""


def _gratings(measured: Measurements) -> str:
    by_name = goals.models_of(measured.by_model, "keratin")
    parts = []
    for name in ("first_order", DEFAULT):
        comparison = by_name[name]
        lights = (
            models.banded(comparison, [60.0], measure) for measure in (models.of_te, models.of_tm)
        )
        parts.append([
            (f"keratin, {profile}", f"{low:g} to {high:g}", [*values, *te[2], *tm[2]])
            for (profile, (low, high), values), te, tm in zip(
                models.banded(comparison), *lights, strict=True
            )
        ])  # fmt: skip
    rows = [
        [
            *first[:2],
            *(" / ".join(map(percent, pair)) for pair in zip(first[2], second[2], strict=True)),
        ]
        for first, second in zip(*parts, strict=True)
    ]
    header = ["grating", "depth/period", *map(angle, models.ANGLES), "TE 60°", "TM 60°"]
    every = goals.singles(by_name)
    worse = sorted((c for c in every if _harm(c) > max(c.change, 0.001)), key=_harm, reverse=True)
    columns = ("kirchhoff", "first_order", DEFAULT)
    harmed = [
        [c.label, angle(c.theta), *(percent(c.deviation(name)) for name in columns)] for c in worse
    ]
    names = ["Kirchhoff", "`second_order=false`", "`second_order=true`"]
    return f"""## Gratings

Deviation of colours with `second_order=false` / `second_order=true`:

{table(header, rows)}

At the walls of lamellar and blazed gratings a gate switches the factor off. Of {len(every)}
gratings and angles {len(worse)} are worse with the factor, by more than the solver's last
refinement changed and a tenth of a point:

{table(["", "light from", *names], harmed)}

The factor is fitted to all travelling waves; an order of a sinusoid has two."""


def _rows(cases: Sequence[Case], names: Sequence[str], lit: Sequence[str]) -> list[list[str]]:
    """A row for each group: deviations by model, mean and worst; range of the light of some."""
    rows = []
    for group in dict.fromkeys(case.group for case in cases):
        same = [case for case in cases if case.group == group]
        row = [group, str(len(same))]
        for name in names:
            errors = [case.deviation[name] for case in same]
            row.append(f"{percent(float(np.mean(errors)))}, {percent(max(errors))}")
        for name in lit:
            light = [case.light[name] for case in same]
            row.append(f"{min(light):.3f}–{max(light):.3f}")
        rows.append(row)
    return rows


def _harm(case: goals.Case) -> float:
    """How much the factor adds to the deviation."""
    return case.deviation(DEFAULT) - case.deviation("first_order")
