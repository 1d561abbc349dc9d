"""Pieces of Markdown: tables, and numbers with as many digits as they deserve."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import partial

from docs.make.figures import pages

from ..cases import Grating
from ..compare import Sides, table_of
from ..models import BOTH, of_colours

#: Table whose columns but the first are aligned to the right.
table = partial(pages.table, right=True)


def percent(value: float) -> str:
    """Per cent with two digits; NaN is a dash."""
    if math.isnan(value):
        return "–"
    share = 100 * value
    if 0 < abs(share) < 0.01:
        return "< 0.01 %"
    text = f"{share:.0f} %" if abs(share) >= 9.95 else f"{share:.2g} %"
    return text.replace("-", "−")


def angle(degrees: float) -> str:
    """An angle in degrees, with a true minus sign."""
    return f"{degrees:g}°".replace("-", "−")


def beside(*columns: Iterable[float]) -> list[str]:
    """Cells with the numbers of several columns in per cent: 1 % / 2 %."""
    return [" / ".join(map(percent, values)) for values in zip(*columns, strict=True)]


def both_models(sides: Sides, grating: Grating, angles: Sequence[float]) -> list[str]:
    """Cells with the deviations of colours of Kirchhoff and the default, one for each angle."""
    return beside(*(table_of(sides[name], [grating], angles, of_colours)[0] for name in BOTH))


def joined(values: Sequence[float]) -> str:
    """Numbers as a sentence has them: 1, 2 and 3."""
    return ", ".join(f"{value:g}" for value in values[:-1]) + f" and {values[-1]:g}"
