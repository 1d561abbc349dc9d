"""What a treatment of a height field gives back besides the heights: what it changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..field import HeightField


@dataclass(frozen=True)
class Change:
    """What one treatment did to the heights.

    Attributes
    ----------
    line
        One line for people; it becomes the last entry of the new field's `history`.
    rms
        Root-mean-square change of height in µm, a common offset left out: it changes no light.
    figures
        What else was measured, by name: plain numbers, lengths in µm.
    """

    line: str
    rms: float
    figures: Mapping[str, float] = field(default_factory=dict)


def changed(
    before: HeightField,
    heights: npt.NDArray[np.float64],
    what: str,
    **figures: float,
) -> tuple[HeightField, Change]:
    """Make the treated field, with `what` and the RMS change appended to its history."""
    rms = float((heights - before.heights).std())
    line = f"{what}; RMS change {rms:.3g} µm"
    treated = HeightField(
        heights,
        before.pixel_size,
        name=before.name,
        history=(*before.history, line),
        cut_out=before.cut_out,
    )
    return treated, Change(line, rms, figures)
