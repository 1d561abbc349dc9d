"""docs/validation/numerics.md: closed forms of gratings, statistics of random surfaces."""

from __future__ import annotations

import numpy as np

from ..cases import PROFILES, Grating
from ..closed_forms import ANGLES, deviations
from .markdown import table
from .measurements import Measurements

#: Periods and depths of ideal gratings, µm.
_IDEAL = ((1.1, 0.4), (2.5, 0.1), (5.0, 0.4))


def write(measured: Measurements) -> str:
    """Write the page."""
    return f"""# Closed forms and random surfaces

Tests of the integral and the tables, not of the physical model.

{_closed_forms(measured)}

{_random_surfaces(measured)}"""


def _closed_forms(measured: Measurements) -> str:
    sizes = _IDEAL[1:2] if measured.quick else _IDEAL
    rows = []
    for profile in PROFILES:
        compared = [deviations(Grating(profile, *lengths)) for lengths in sizes]
        integral = max(item.integral for item in compared)
        by_table = max(item.table for item in compared)
        orders = sum(item.orders for item in compared)
        rows.append([profile, orders, f"{integral:.1e}", f"{by_table:.1e}"])
    words = " or ".join(f"{period:g} and {depth:g}" for period, depth in sizes)
    return f"""## Gratings in closed form

Largest absolute error of an order's power |a_m|², with a sum of 1 over all orders. Light and
orders up to {ANGLES[-1]:g}° from the normal, 410 to 760 nm, period and depth {words} µm, 512 pixels
a period. The errors of lamellar and blazed gratings come from sampling.

{table(["profile", "orders", "`reference.brdf`", "table"], rows)}"""


def _random_surfaces(measured: Measurements) -> str:
    specular, offsets = measured.statistics.specular, measured.statistics.offsets
    estimates = zip(
        specular.places, specular.mean, specular.error, specular.exact, specular.distance,
        strict=True,
    )  # fmt: skip
    rows = [
        [f"{x:g}", f"{mean:.4f} ± {error:.4f}", f"{exact:.4f}", f"{distance:+.1f}"]
        for x, mean, error, exact, distance in estimates
    ]
    lobes = [
        [each.name, len(z := each.distance), f"{np.sqrt(np.mean(z**2)):.2f}",
         f"{np.abs(z).max():.1f}"]
        for each in (*measured.statistics.lobes.values(), offsets)
    ]  # fmt: skip
    return f"""## Random surfaces

Gaussian heights with the autocorrelation rms²·exp(−r²/T²), beside exp(−(κ·rms)²) with scattered
light in the bin (order 0, left), the series of Beckmann and Spizzichino (lobes, middle) and
`ensemble` (mean of `patch` at {offsets.count} random places, right).

![Specular loss, scattered lobes, and the mean of patches](../images/validation_statistics.png)

{table(["κ·rms", f"mean of {specular.count} surfaces", "exact", "in standard errors"], rows)}

Differences of lobes and of the mean of patches, in standard errors; the expected root-mean-square
is 1.

{table(["rms", "directions", "root-mean-square", "largest"], lobes)}"""
