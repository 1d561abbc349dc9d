"""Size, relief and shape of single scales: rhombic tiles on the back, wide scutes on the belly.

In (u, v) the rows interlock like the squares of a turned chessboard. Every tile rises from its
front corner to its free rear corner, so that along each of its two rear edges it stands half a
step above the two neighbours behind; it reaches beyond those edges and covers their fronts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.errors import DiffractionError

from .limits import check_limits

Floats = NDArray[np.float64]

BELLY = 0.13  # half the belly's share of the circumference
CAMBER = 0.16  # how far the side corners of a scale lie lower than its middle, in reliefs
BOW = 0.8  # how much a scale is bent along the body, in reliefs

#: Lowest and highest value of each parameter of `Scales`.
LIMITS: dict[str, tuple[float, float]] = {
    "rows": (7, 61),
    "aspect": (0.5, 3.0),
    "relief": (0.0, 0.2),
    "overlap": (0.0, 0.5),
    "keel": (0.0, 1.0),
    "roundness": (0.0, 0.3),
    "irregularity": (0.0, 5.0),
    "seed": (0, 2**32),
    "turn": (-360.0, 360.0),
    "fan": (-90.0, 90.0),
    "detail": (1, 32),
}


@dataclass(frozen=True)
class Scales:
    """Size and relief of the scales.

    Attributes
    ----------
    rows : odd number of rows across the back (15 in Xenopeltis, 19 to 29 in rat snakes).
    aspect : visible length of a scale over its visible width.
    relief : height of the free rear end over the skin, in visible lengths.
    overlap : how far a scale reaches over those behind, in visible lengths.
    keel : height of the keel in units of the relief; 0 is a smooth scale.
    roundness : how far the rear edges bulge; 0 is a rhombus.
    irregularity : largest angle by which single scales lie askew; degrees.
    seed : which scales lie askew by how much.
    turn : angle from dp/du, which points tailwards, to the patch's x axis; degrees.
    fan : angle by which the patch turns further, outwards from keel to side corners; degrees.
    detail : subdivisions of an edge of a scale.
    """

    rows: int = 17
    aspect: float = 1.25
    relief: float = 0.07
    overlap: float = 0.22
    keel: float = 0.5
    roundness: float = 0.16
    irregularity: float = 2.0
    seed: int = 0
    turn: float = 0.0
    fan: float = 0.0
    detail: int = 4

    def __post_init__(self) -> None:
        check_limits(self, LIMITS)
        if self.rows % 2 == 0:
            raise DiffractionError(
                f"snake: rows = {self.rows} is even; one runs along the spine: make it odd"
            )

    @property
    def row_pitch(self) -> float:
        """Distance of neighbouring rows in v; a tile is two of them wide."""
        return (1 - 2 * BELLY) / (self.rows + 1)

    @property
    def pitch(self) -> float:
        """Distance of a scale from the next one in its row, in u."""
        return 2 * self.row_pitch * self.aspect

    def tile(
        self, start: Floats, level: Floats, p: Floats, q: Floats, askew: Floats
    ) -> tuple[Floats, ...]:
        """Map a scale to (u, v, height).

        Parameters
        ----------
        start, level : u of the front corner in half pitches, v in row pitches from the belly.
        p, q : 0 to 1 from the front corner along its left and its right edge.
        askew : (2, n), the scale's own angles along and across, radians.
        """
        # rounding moves the rear edges only, or the fronts below would move too
        wide_p = p + 4 * self.roundness * q * (1 - q) * p**2
        wide_q = q + 4 * self.roundness * p * (1 - p) * q**2
        u = self.pitch * (start + (1 + self.overlap) * (wide_p + wide_q)) / 2
        v = BELLY + self.row_pitch * (level + wide_q - wide_p)

        along, across = (p + q) / 2, q - p
        ridge = self.keel * np.exp(-((across / 0.22) ** 2)) * smoothstep((along - 0.12) / 0.3)
        steps = along + ridge - CAMBER * across**2 - BOW * (along - 0.5) ** 2
        height = self.relief * self.pitch * steps
        # the side corners, where scales of one row meet, stay where they are
        height += askew[0] * self.pitch * (along - 0.5)
        height += askew[1] * self.row_pitch * across * (1 - across**2)
        return u, v, height

    def scute(
        self, start: Floats, side: Floats, along: Floats, across: Floats, askew: Floats
    ) -> tuple[Floats, ...]:
        """Map half a belly scale to (u, v, height).

        Parameters
        ----------
        start : u of its front in half pitches.
        side : 0 or 1, on which side of the seam.
        along, across : 0 to 1 from front to rear, 0 to 1 from the seam to the lowest scales.
        askew : not used, the wide scutes lie straight.
        """
        u = self.pitch * (start / 2 + (1 + self.overlap) * along)
        # the ends are pointed and reach between the lowest scales of the back
        point = 1 - np.abs(2 * along - 1)
        v = (BELLY + self.row_pitch * point) * across
        height = self.relief * self.pitch * (along - CAMBER * point * across**2)
        return u, np.where(side > 0, 1 - v, v), height


def smoothstep(x: Floats) -> Floats:
    """3x² − 2x³ between 0 and 1, and flat beyond."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)
