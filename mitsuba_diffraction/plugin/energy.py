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

from ..files.bound_cache import cached_bound
from ..tables.bound import AZIMUTHAL, LAST_ANGLE, POLAR, SHARE
from ..tables.table import DiffractionTable
from .lookup import index_between, read, upload


class EnergyBound:
    """The divisor, for one table and the height scale last given."""

    def __init__(self, table: DiffractionTable) -> None:
        self._table = table
        self._height_scale = math.nan
        self._values: Any = None

    def update(self, height_scale: float) -> None:
        """Look up, or compute, the bound for another height scale."""
        if height_scale != self._height_scale:
            values = cached_bound(self._table, height_scale).values
            self._values = upload(mi.Float, np.maximum(values, np.float32(1.0)))
            self._height_scale = height_scale

    def divisor(self, incident: Any, cos_i: Any, outgoing: Any, cos_o: Any) -> Any:
        """max(1, a(ωi), a(ωo)), from tangential parts in the patch's frame and cosines."""
        return dr.maximum(self._bound(incident, cos_i), self._bound(outgoing, cos_o))

    def _bound(self, tangential: Any, cosine: Any) -> Any:
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
            values = (read(mi.Float, self._values, start + n) for n in (0, 1))
            return dr.lerp(*values, t)

        bound = dr.lerp(along(index), along(index + (AZIMUTHAL + 1)), s)
        # Towards the horizon the albedo grows with 1/cos²θ
        beyond = dr.maximum(math.cos(LAST_ANGLE) * dr.rcp(dr.maximum(cosine, 1e-6)), 1.0)
        return bound * dr.square(beyond)
