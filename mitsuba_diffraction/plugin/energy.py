"""Energy conservation (Dr.Jit): the raw Kirchhoff BRDF over max(1, a(ωi), a(ωo)).

a bounds the directional albedo from above (`tables.bound`), so that the quotient's albedo is at
most 1, and the divisor is symmetric in its directions, so that it stays reciprocal.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..files.bound_cache import BoundsAround, bounds_around
from ..tables.bound import AZIMUTHAL, LAST_ANGLE, POLAR, SHARE
from ..tables.table import DiffractionTable
from .memory import index_between, read, upload


class EnergyBound:
    """The divisor, for one table and the height scale last given."""

    def __init__(self, table: DiffractionTable) -> None:
        self._table = table
        self._height_scale = math.nan
        self._around: BoundsAround | None = None
        self._ends: tuple[Any, Any] = (None, None)
        self._values: Any = None
        self._low, self._slope = mi.Float(0.0), mi.Float(0.0)

    def update(self, height_scale: float, differentiable: bool = False) -> None:
        """Look up, or compute, the bound for another height scale."""
        if height_scale == self._height_scale and not differentiable:
            return
        around = bounds_around(self._table, height_scale, interval=differentiable)
        low, high = (np.maximum(bound.values, np.float32(1.0)) for bound in around.bounds)
        if self._around is None or around.scales != self._around.scales:
            self._around = around
            self._ends = upload(mi.Float, low), upload(mi.Float, high)
            width = around.scales[1] - around.scales[0]
            self._low = mi.Float(around.scales[0])
            self._slope = mi.Float(1.0 / width if width > 0.0 else 0.0)
            dr.make_opaque(self._low, self._slope)
        share = np.float32(around.share(height_scale))
        self._values = upload(mi.Float, low * (1 - share) + high * share)
        self._height_scale = height_scale

    def divisor(
        self, incident: Any, cos_i: Any, outgoing: Any, cos_o: Any, height_scale: Any
    ) -> Any:
        """max(1, a(ωi), a(ωo)), from tangential parts in the patch's frame and cosines.

        height_scale : the one given to `update`; needed where derivatives with respect to it are.
        """
        share = None
        if dr.grad_enabled(height_scale):
            share = (height_scale - self._low) * self._slope
        return dr.maximum(self._bound(incident, cos_i, share), self._bound(outgoing, cos_o, share))

    def _read(self, index: Any, share: Any | None) -> Any:
        """The bound at a vertex; interpolated here only where its derivative is wanted."""
        if share is None:
            return read(mi.Float, self._values, index)
        low, high = (read(mi.Float, end, index) for end in self._ends)
        return dr.lerp(low, high, share)

    def _bound(self, tangential: Any, cosine: Any, share: Any | None) -> Any:
        """max(1, a): bilinear in (θ, φ), like `AlbedoBound`."""
        remaining = 1.0 - dr.safe_acos(cosine) * (2.0 / dr.pi)
        row = (1.0 - dr.safe_sqrt(remaining)) * (POLAR / SHARE)
        column = dr.atan2(tangential.y, tangential.x) * (AZIMUTHAL / (2.0 * dr.pi))
        column = dr.select(column < 0.0, column + AZIMUTHAL, column)
        i = mi.UInt32(index_between(row, 0.0, POLAR - 1.0))
        j = mi.UInt32(index_between(column, 0.0, AZIMUTHAL - 1.0))
        s, t = dr.clip(row - i, 0.0, 1.0), dr.clip(column - j, 0.0, 1.0)
        index = i * (AZIMUTHAL + 1) + j

        def along(start: Any) -> Any:
            values = (self._read(start + n, share) for n in (0, 1))
            return dr.lerp(*values, t)

        bound = dr.lerp(along(index), along(index + (AZIMUTHAL + 1)), s)
        # Towards the horizon the albedo grows with 1/cos²θ
        beyond = dr.maximum(math.cos(LAST_ANGLE) * dr.rcp(dr.maximum(cosine, 1e-6)), 1.0)
        return bound * dr.square(beyond)
