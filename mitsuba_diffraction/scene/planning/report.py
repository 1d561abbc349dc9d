"""What a plan found, as nested plain data, and look-ups in its tables: time, how many outside."""

from __future__ import annotations

import math
import time
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...optics.geometry import wavenumber
from ...plugin.restricted import Outside, RestrictedTable, device_table
from ...plugin.sampling import sampler_bytes
from ...tables.table import DiffractionTable
from .make import Difference, RecordedScene, TestedPlan
from .plan import Lookups, Plan, lobes_in_a_pixel, quantiles, wavelengths_needed

#: That are timed: some hundredths of a second.
LOOKUPS = 1 << 19


def evaluation_ratio(asked: Lookups, whole: DiffractionTable, planned: DiffractionTable) -> float:
    """Time of a look-up in the planned table over that in the whole one, where the scene asks."""
    rng = np.random.default_rng(0)
    chosen = rng.integers(0, len(asked.w), LOOKUPS)
    k = wavenumber(asked.wavelength[chosen])
    q = [mi.Float((k * a[chosen]).astype(np.float32)) for a in (asked.u, asked.v, asked.w)]
    dr.eval(q)
    seconds: dict[int, float] = {}
    for _ in range(10):  # in turn, the first to compile
        for n, table in enumerate((whole, planned)):
            start = time.perf_counter()
            dr.eval(device_table(table).window_sum(*q))
            dr.sync_thread()
            passed = time.perf_counter() - start
            seconds[n] = min(seconds.get(n, passed), passed)
    outside_of(planned)
    return seconds[1] / seconds[0]


def outside_of(table: DiffractionTable) -> Outside | None:
    """Look-ups beyond a planned table since the last time, or None if it is a whole one."""
    device = device_table(table)
    return device.take() if isinstance(device, RestrictedTable) else None


def describe(loaded: RecordedScene, found: TestedPlan) -> dict[str, Any]:
    """What each table is asked for, what it needs, and what a plan saves and changes."""
    tables = [
        _of_table(key, loaded, found.plan, found.planned, found.seconds)
        for key in found.plan.tables
    ]
    return {"tables": tables, **_of_picture(found.plan, found.difference)}


def _of_table(
    key: str, loaded: RecordedScene, plan: Plan, planned: dict[str, Any], seconds: dict[str, float]
) -> dict[str, Any]:
    table, mine = loaded.session.tables[key], plan.tables[key]
    result: dict[str, Any] = {"surfaces": ", ".join(mine.surfaces), "heights": mine.name}
    whole = _figures(table, loaded.session.seconds.get(key, math.nan))
    asked = loaded.statistics.get(key)
    if asked is None:
        return result | {"asked for": "nothing: no path meets it; it stays whole", "whole": whole}
    bsdfs = [n for n, (_, bsdf) in enumerate(loaded.session.bsdfs) if bsdf.table is table]
    lobes = max(
        (lobes_in_a_pixel(float(loaded.traced.lobe_turn[n]), table.sigma) for n in bsdfs),
        default=math.nan,
    )
    light = asked.light
    result["asked for"] = {
        "share of the surfaces' light that is diffracted": float(light.sum()),
        "frequency (rad/µm)": _shares(asked.frequency, light, "light can probe", table.q_limit),
        "frequency along x (rad/µm)": _shares(asked.along[0], light),
        "frequency along y (rad/µm)": _shares(asked.along[1], light),
        "kappa (rad/µm)": _shares(asked.kappa, light, "the table has", table.expansion.kappa_max),
        "wavelengths of 99.9 %": wavelengths_needed(asked),
        "lobes of the window in a pixel": lobes,
        "coherence": _coherence(table.coherence, lobes),
    }
    if mine.domain is None:
        return result | {
            "needs": "all of it: a smaller table would save too little",
            "whole": whole,
        }
    smaller = planned[key]
    return result | {
        "needs": {
            "frequency (rad/µm), along x and y": list(mine.domain.crop),
            "kappa (rad/µm)": mine.domain.kappa_max,
            "tolerance of the table": mine.domain.tolerance,
            "share of the light outside, read from coarse cells": mine.domain.outside,
        },
        "whole": whole,
        "planned": _figures(smaller, seconds.get(key, math.nan))
        | {"time of a look-up / that in the whole": evaluation_ratio(asked, table, smaller)},
        "times less memory": table.nbytes / smaller.nbytes,
    }


def _figures(table: DiffractionTable, seconds: float) -> dict[str, Any]:
    """Of a table that took these seconds to build."""
    return {
        "memory_mb": table.nbytes / 1e6,
        "sampling_memory_mb": sampler_bytes(table) / 1e6,
        "build_s": seconds,
        "terms": f"{table.expansion.intervals} x {table.expansion.terms}",
        "precision": str(table.coefficients.dtype),
        "taps": list(table.grid.taps),
    }


def _shares(values: Any, light: Any, name: str = "", limit: float = 0.0) -> dict[str, float]:
    """Below which values there are these shares of the light, and the largest that could be."""
    below = [0.5, 0.99, 0.999]
    found = {
        f"{100 * share:g} % of the light below": value
        for share, value in zip(below, quantiles(values, light, below), strict=True)
    }
    return found | ({name: limit} if name else {})


def _coherence(given: str, lobes: float) -> str:
    if not lobes >= 0.0:
        return f"{given}; the camera does not see the surface itself"
    if given == "patch" and lobes > 16.0:
        return "patch; a pixel averages so many lobes that ensemble would show the same, for less"
    if given == "ensemble" and lobes < 1.0:
        return "ensemble; a pixel is narrower than a lobe, patch would show its speckle"
    return f"{given}, as it is"


def _of_picture(plan: Plan, measured: Difference | None) -> dict[str, Any]:
    if measured is None or not plan.limits():
        return {"gain": "none: every table is needed as it is"}
    return {
        "picture, planned against whole, same random numbers": {
            "mean difference / mean (XYZ)": measured.relative,
            "below the tolerance": measured.relative <= plan.tolerance,
            "delta E 2000, mean": measured.delta_e_mean,
            "delta E 2000, 99 %": measured.delta_e_99,
            "pixels": list(measured.size),
            "samples per pixel": measured.spp,
        }
    }
