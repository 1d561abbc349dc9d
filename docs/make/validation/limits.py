"""Up to which slope the model may be trusted: where the package's warnings come from.

The rule: sinusoids of a perfect conductor are put in the order of their RMS slope; a limit is the
slope of the last one before the first whose deviation (`Comparison.deviation`, over all counted
orders, or over the colours alone) exceeds an error at any angle of incidence up to 45°. A sinusoid
has no edges, and a perfect conductor reflects all light at every angle: nothing but the slope is
left to decide. (A dielectric's reflectance errs at oblique angles on any slope.)
"""

from __future__ import annotations

from .cases import Grating
from .compare import Comparison, angles_of, gratings_of, table_of

#: Deviations that `validity.GENTLE_SLOPE` and `validity.STEEP_SLOPE` stand for.
GENTLE_ERROR = 0.05
STEEP_ERROR = 0.2
#: Largest angle of incidence of the rule, degrees.
STEEPEST_LIGHT = 45.0


def rms_slope(grating: Grating) -> float:
    """As `HeightField.rms_slope` has it."""
    return grating.heights().rms_slope


def worst_deviations(comparison: Comparison) -> list[tuple[Grating, float, float]]:
    """Each sinusoid with its RMS slope and largest deviation under the rule, gentlest first."""
    of_sinusoids = angles_of(comparison.where(profile="sinusoidal"))
    angles = [theta for theta in of_sinusoids if abs(theta) <= STEEPEST_LIGHT]
    sinusoids = gratings_of(comparison, "sinusoidal")
    measures = (Comparison.deviation, lambda part: part.deviation(colours=True))
    tables = [table_of(comparison, sinusoids, angles, measure) for measure in measures]
    found = [
        (grating, rms_slope(grating), float(max(table[n].max() for table in tables)))
        for n, grating in enumerate(sinusoids)
    ]
    return sorted(found, key=lambda item: item[1])


def slope_limit(comparison: Comparison, error: float) -> float:
    """Largest RMS slope up to which no sinusoid deviates by more than `error`; 0 if all do."""
    limit = 0.0
    for _, slope, deviation in worst_deviations(comparison):
        if deviation > error:
            break
        limit = slope
    return limit
