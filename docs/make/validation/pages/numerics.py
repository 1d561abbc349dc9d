"""Parts of docs/validation/numerics.md: closed forms of gratings, statistics of random surfaces."""

from __future__ import annotations

import numpy as np

from ..cases import PROFILES, Grating
from ..closed_forms import ANGLES, deviations
from .markdown import table
from .measurements import Measurements

#: Periods and depths of ideal gratings, µm.
_IDEAL = ((1.1, 0.4), (2.5, 0.1), (5.0, 0.4))


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    return {**_closed_forms(measured), **_random_surfaces(measured)}


def _closed_forms(measured: Measurements) -> dict[str, str]:
    sizes = _IDEAL[1:2] if measured.quick else _IDEAL
    rows = []
    for profile in PROFILES:
        compared = [deviations(Grating(profile, *lengths)) for lengths in sizes]
        integral = max(item.integral for item in compared)
        by_table = max(item.table for item in compared)
        orders = sum(item.orders for item in compared)
        rows.append([profile, orders, f"{integral:.1e}", f"{by_table:.1e}"])
    words = " or ".join(f"{period:g} and {depth:g}" for period, depth in sizes)
    return {
        "sizes": f"up to {ANGLES[-1]:g}° from the normal, 410 to 760 nm, period and depth {words}",
        "gratings": table(["profile", "orders", "`reference.brdf`", "table"], rows),
    }


def _random_surfaces(measured: Measurements) -> dict[str, str]:
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
    header = ["κ·rms", f"mean of {specular.count} surfaces", "exact", "in standard errors"]
    return {
        "places": f"{offsets.count}",
        "random-surfaces": table(header, rows),
        "lobes": table(["rms", "directions", "root-mean-square", "largest"], lobes),
    }
