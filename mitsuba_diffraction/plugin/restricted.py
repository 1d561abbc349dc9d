"""Reading a table of a restricted domain: the orders where it has them, coarse cells elsewhere."""

from __future__ import annotations

import math
import weakref
from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from ..tables.table import DiffractionTable
from .lookup import DeviceTable, within
from .types import Float, Index
from .window_positions import Window

_uploaded: weakref.WeakKeyDictionary[DiffractionTable, dict[str, DeviceTable | RestrictedTable]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True)
class Outside:
    """Look-ups that the orders of a table did not reach.

    Attributes
    ----------
    count : how many since the last `take`.
    frequency, kappa : the largest |q| and κ among them, rad/µm.
    """

    count: int
    frequency: float
    kappa: float


class RestrictedTable:
    """Two tables as one: `fine` within its domain, `coarse` beyond, where it counts.

    Parameters
    ----------
    fine, coarse : `plugin.lookup.DeviceTable`.
    radii, kappa_max : where the fine one ends, (x, y) and κ in rad/µm.
    """

    def __init__(
        self, fine: DeviceTable, coarse: DeviceTable, radii: tuple[float, float], kappa_max: float
    ) -> None:
        self.fine, self.coarse = fine, coarse
        self._radii, self._kappa_max = radii, kappa_max * (1 + 1e-6)
        self._jit = dr.is_jit_v(mi.Float)
        self._count: Index = mi.UInt32(0)
        self._farthest: Float = mi.Float(0.0)
        self._deepest: Float = mi.Float(0.0)
        self.take()

    def window_sum(
        self, qx: Float, qy: Float, kappa: Float, windows: Sequence[Window] = ()
    ) -> Float:
        """See `DeviceTable.window_sum`; coarse cells are the mean over all windows."""
        square = dr.square(qx) + dr.square(qy)
        inside = within(qx, qy, self._radii) & (kappa <= self._kappa_max)
        if not self._jit:
            if inside:
                return self.fine.window_sum(qx, qy, kappa, windows)
            self._count += 1
            self._farthest = max(self._farthest, square)
            self._deepest = max(self._deepest, kappa)
            return self.coarse.window_sum(qx, qy, kappa)
        # A NaN, as from a degenerate mesh, is no look-up, and stays one
        outside = ~inside & dr.isfinite(square) & dr.isfinite(kappa)

        def beyond(qx: Float, qy: Float, kappa: Float, result: Float) -> Float:
            far = dr.detach(dr.square(qx) + dr.square(qy))
            # Not a copy of the counters a thread, as Dr.Jit would choose for small arrays: a frozen
            # function that is called again brings counters without them
            direct = dr.ReduceMode.Direct
            dr.scatter_reduce(dr.ReduceOp.Add, self._count, mi.UInt32(1), mi.UInt32(0), mode=direct)
            dr.scatter_reduce(dr.ReduceOp.Max, self._farthest, far, mi.UInt32(0), mode=direct)
            dr.scatter_reduce(
                dr.ReduceOp.Max, self._deepest, dr.detach(kappa), mi.UInt32(0), mode=direct
            )
            return self.coarse.window_sum(qx, qy, kappa)

        # Rare, so branched to: a kernel skips what none of its lanes needs
        return dr.if_stmt(
            (qx, qy, kappa, self.fine.window_sum(qx, qy, kappa, windows)),
            outside,
            beyond,
            lambda qx, qy, kappa, result: result,
        )

    def order_0(self, kappa: Float) -> Float:
        """See `DeviceTable.order_0`."""
        return dr.select(
            kappa <= self._kappa_max, self.fine.order_0(kappa), self.coarse.order_0(kappa)
        )

    def take(self) -> Outside:
        """What was counted since the last time."""
        if not self._jit:
            found = Outside(self._count, math.sqrt(self._farthest), self._deepest)
            self._count, self._farthest, self._deepest = 0, 0.0, 0.0
            return found
        values = [float(np.array(a)[0]) for a in (self._count, self._farthest, self._deepest)]
        for counter, kind in (
            ("_count", mi.UInt32), ("_farthest", mi.Float), ("_deepest", mi.Float),
        ):  # fmt: skip
            setattr(self, counter, dr.opaque(kind, 0))
        return Outside(int(values[0]), math.sqrt(values[1]), values[2])


def device_table(table: DiffractionTable) -> DeviceTable | RestrictedTable:
    """The table in the current variant's memory, uploaded once for all BSDFs that share it."""
    variants = _uploaded.setdefault(table, {})
    if mi.variant() not in variants:
        device = DeviceTable(table)
        variants[mi.variant()] = device
        if table.coarse is not None:
            coarse, kappa_max = DeviceTable(table.coarse), table.expansion.kappa_max
            variants[mi.variant()] = RestrictedTable(device, coarse, table.q_max, kappa_max)
    return variants[mi.variant()]
