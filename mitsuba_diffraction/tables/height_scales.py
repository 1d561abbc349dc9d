"""Height scales of a table at which functions of the height scale are tabulated."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .table import DiffractionTable

#: Height scales are n/steps: this phase (rad) changes at most in between. The power of an order
#: bends by a fiftieth then, and by less at grazing angles, where there is most to take.
_PHASE = 0.8
_FEWEST_STEPS = 4
#: As good as no heights at all.
_FLAT = 1e-3


@dataclass(frozen=True)
class HeightScales:
    """Height scales of a table for which something is made when asked for.

    table : the table.
    """

    table: DiffractionTable

    def nodes(self, height_scale: float, *, interval: bool = False) -> tuple[float, float]:
        """Return the two height scales around one, for which something is made; equal at a node.

        They lie evenly, 1 among them, so close that an order's power bends little in between. An
        optimisation of the heights thus sees a continuous scale with derivatives, and waits only
        where it enters an interval that nobody has been in before.

        interval : two nodes even if the scale is at one, for derivatives.
        """
        steps, most = self._lattice

        def node(n: int) -> float:
            return min(max(n / steps, _FLAT), most)

        position = height_scale * steps  # of a scale in single precision
        lower = min(math.floor(position + 1e-4), math.ceil(most * steps - 1e-4) - 1)
        at_node = abs(position - lower) < 1e-4
        return node(lower), node(lower if at_node and not interval else lower + 1)

    @property
    def most(self) -> float:
        """Largest height scale."""
        return self.table.height_scale_max

    @property
    def _lattice(self) -> tuple[int, float]:
        """Height scales a unit, and the largest."""
        phase = 2.0 * self.table.q_limit * self.table.expansion.half_range
        # Beyond the table's own limit nothing can be looked up, so the last interval is shorter
        most = max(self.most, _FLAT)
        return max(_FEWEST_STEPS, math.ceil(phase / _PHASE)), most

    def between(self, low: float, high: float) -> list[float]:
        """Height scales at even distances, as close together, for all between two."""
        steps, most = self._lattice
        first = max(math.floor(low * steps) / steps, _FLAT)
        last = min(math.ceil(high * steps) / steps, most)
        return np.linspace(first, last, 1 + max(1, math.ceil((last - first) * steps))).tolist()
