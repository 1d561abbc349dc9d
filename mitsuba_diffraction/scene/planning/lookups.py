"""Look-ups in planned tables: their time, and how many fall outside."""

from __future__ import annotations

import time

import drjit as dr
import mitsuba as mi
import numpy as np

from ...optics.geometry import wavenumber
from ...plugin.restricted import Outside, RestrictedTable, device_table
from ...tables.table import DiffractionTable
from .domain import LookupStatistics

#: That are timed: some hundredths of a second.
LOOKUPS = 1 << 19


def evaluation_ratio(
    asked: LookupStatistics, whole: DiffractionTable, planned: DiffractionTable
) -> float:
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
