"""Which setting to take, within a budget."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import DiffractionError
from .measuring import Measured

_ALIKE = 1.1  # times differ by as much from one run to the next


@dataclass(frozen=True)
class Budget:
    """What a user can afford; None: as much as it takes.

    Attributes
    ----------
    tolerance : largest error.
    megabytes : of the table.
    relative : time of `eval` over that of `roughconductor`.
    """

    tolerance: float | None = None
    megabytes: float | None = None
    relative: float | None = None

    def allows(self, one: Measured) -> bool:
        """Whether a setting stays within it."""
        limits = (
            (one.error, self.tolerance),
            (one.megabytes, self.megabytes),
            (one.relative, self.relative),
        )
        return all(limit is None or value <= limit for value, limit in limits)


def recommended(results: Sequence[Measured], budget: Budget) -> Measured:
    """The fastest setting that is exact enough; without a tolerance, the most exact one.

    Of settings that are about as fast the smallest is taken.

    Only settings that compute the same thing (coherence `ensemble`) and that a user can ask for
    compete.

    Raises
    ------
    DiffractionError
        If nothing that was measured stays within the budget.
    """
    able = [
        one
        for one in results
        if not one.refused
        and one.setting.usable
        and one.setting.group != "coherence"
        and math.isfinite(one.error)
    ]
    within = [one for one in able if budget.allows(one)]
    if not within:
        smallest = min(one.megabytes for one in able)
        fastest = min(one.relative for one in able)
        finest = min(one.error for one in able)
        raise DiffractionError(
            f"no setting stays within this budget: errors reach down to {finest:.1e}, tables to "
            f"{smallest:.1f} MB and eval to {fastest:.1f} times roughconductor, but not all at "
            "once; allow more of one"
        )
    if budget.tolerance is None:
        return min(within, key=lambda one: one.error)
    fastest = min(one.relative for one in within)
    as_fast = [one for one in within if one.relative <= _ALIKE * fastest]
    return min(as_fast, key=lambda one: one.megabytes)
