"""Energy conservation (Dr.Jit): the raw Kirchhoff BRDF over max(1, a(ωi), a(ωo)).

a bounds the directional albedo from above (`tables.bound`), so that the quotient's albedo is at
most 1, and the divisor is symmetric in its directions, so that it stays reciprocal.
"""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..tables.energy.bound import AZIMUTHAL, LAST_ANGLE, POLAR, SHARE
from ..tables.store.bounds import BoundsAround, bounds_around
from ..tables.table import DiffractionTable
from .memory import index_between, read_record, upload
from .pair import Pair
from .roles import Buffer, Float, Index, Vector2f


class EnergyBound:
    """The divisor, for one table and the height scale last given."""

    def __init__(self, table: DiffractionTable) -> None:
        self._table = table
        self._height_scale = math.nan
        self._around: BoundsAround | None = None
        self._ends: tuple[Buffer, Buffer] = (None, None)
        self._values: Buffer = None
        self._low, self._slope = mi.Float(0.0), mi.Float(0.0)

    def update(self, height_scale: float, differentiable: bool = False) -> None:
        """Look up, or compute, the bound for another height scale."""
        if height_scale == self._height_scale and not differentiable:
            return
        around = bounds_around(self._table, height_scale, interval=differentiable)
        low, high = (_cells(np.maximum(bound.values, np.float32(1.0))) for bound in around.bounds)
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

    def divisor(self, pair: Pair, height_scale: Float) -> Float:
        """max(1, a(ωi), a(ωo)).

        height_scale : the one given to `update`; needed where derivatives with respect to it are.
        """
        share = None
        if dr.grad_enabled(height_scale):
            share = (height_scale - self._low) * self._slope
        return dr.maximum(
            self._bound(pair.incident, pair.cos_i, share),
            self._bound(pair.outgoing, pair.cos_o, share),
        )

    def _corners(self, cell: Index, share: Float | None) -> list[Float]:
        """The bound at a cell's corners; interpolated here only where its derivative is wanted."""
        if share is None:
            return read_record(self._values, cell, 4)
        low, high = (read_record(end, cell, 4) for end in self._ends)
        return [dr.lerp(*ends, share) for ends in zip(low, high, strict=True)]

    def _bound(self, tangential: Vector2f, cosine: Float, share: Float | None) -> Float:
        """max(1, a): bilinear in (θ, φ), like `AlbedoBound`."""
        remaining = 1.0 - dr.safe_acos(cosine) * (2.0 / dr.pi)
        row = (1.0 - dr.safe_sqrt(remaining)) * (POLAR / SHARE)
        column = dr.atan2(tangential.y, tangential.x) * (AZIMUTHAL / (2.0 * dr.pi))
        column = dr.select(column < 0.0, column + AZIMUTHAL, column)
        i = mi.UInt32(index_between(row, 0.0, POLAR - 1.0))
        j = mi.UInt32(index_between(column, 0.0, AZIMUTHAL - 1.0))
        s, t = dr.clip(row - i, 0.0, 1.0), dr.clip(column - j, 0.0, 1.0)
        corners = self._corners(i * AZIMUTHAL + j, share)
        bound = dr.lerp(dr.lerp(*corners[:2], t), dr.lerp(*corners[2:], t), s)
        # Towards the horizon the albedo grows with 1/cos²θ
        beyond = dr.maximum(math.cos(LAST_ANGLE) * dr.rcp(dr.maximum(cosine, 1e-6)), 1.0)
        return bound * dr.square(beyond)


def _cells(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """All four corners of each cell together: (rows, columns) → (rows − 1, columns − 1, 4)."""
    corners = (values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:])
    return np.stack(corners, axis=-1)
