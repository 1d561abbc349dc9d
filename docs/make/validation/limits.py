"""Largest slopes of the model for given errors, from which the package warns.

The rule: sinusoids of keratin and of aluminium are put in the order of their RMS slope; a limit is
the largest slope below the first whose colours deviate (`Comparison.deviation`, the default model)
by more than an error at any angle of incidence that was solved, up to 60°. A sinusoid has no edges,
so nothing but the slope, the period and the material are left to decide, and the worst of these
does.
"""

from __future__ import annotations

from collections.abc import Sequence

from .cases import Grating
from .compare import Comparison, angles_of, gratings_of, table_of
from .models import of_colours

#: Deviations that `validity.GENTLE_SLOPE` and `validity.STEEP_SLOPE` stand for.
GENTLE_ERROR = 0.05
STEEP_ERROR = 0.2
#: Largest angle of incidence of the rule, degrees.
STEEPEST_LIGHT = 60.0


def worst_deviations(comparisons: Sequence[Comparison]) -> list[tuple[Grating, float, float]]:
    """Each material's sinusoids with slope and largest deviation of colours, gentlest first."""
    deviations = []
    for comparison in comparisons:
        sinusoids = gratings_of(comparison, "sinusoidal")
        angles = [theta for theta in angles_of(comparison) if 0 <= theta <= STEEPEST_LIGHT]
        table = table_of(comparison, sinusoids, angles, of_colours).max(axis=1)
        deviations += [
            (grating, grating.field.rms_slope, float(worst))
            for grating, worst in zip(sinusoids, table, strict=True)
        ]
    return sorted(deviations, key=lambda item: item[1])


def slope_limit(comparisons: Sequence[Comparison], error: float) -> float:
    """Largest RMS slope up to which no sinusoid deviates by more than `error`; 0 if all do."""
    worst = worst_deviations(comparisons)
    # slopes of one depth/period are equal to rounding
    first = min((slope for _, slope, deviation in worst if deviation > error), default=float("inf"))
    return max((slope for _, slope, _ in worst if slope < first - 1e-6), default=0.0)
