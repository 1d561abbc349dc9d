"""Steps of height at the seams of a patch that tiles the plane: opposite edges side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .field import FloatArray, HeightField, blocks

#: A seam counts as a defect where its RMS step is this many times the largest RMS step between
#: neighbouring lines inside: a surface's own edges, as gratings have, occur inside, too.
SEAM_FACTOR = 2.0


@dataclass(frozen=True)
class Seam:
    """Steps of height across one seam, compared with those between neighbouring lines inside."""

    step: float  # RMS step across the seam, µm
    largest_inside: float  # largest RMS step between two neighbouring lines inside, µm
    rise: float  # mean of last minus first line, µm
    slope: float  # sum of squared slopes across the seam
    slope_inside: float  # sum of squared slopes between neighbours inside

    @property
    def defect(self) -> bool:
        """Whether the step is larger than any that the surface has inside."""
        return self.step > SEAM_FACTOR * self.largest_inside


def seam_step(field: HeightField) -> float:
    """Return the RMS step of height across both seams, µm."""
    return float(np.sqrt(np.mean(np.concatenate(edge_steps(field)) ** 2)))


def edge_steps(field: HeightField) -> tuple[FloatArray, FloatArray]:
    """Return last minus first column (ny,) and last minus first row (nx,), µm."""
    h = field.heights
    return h[:, -1] - h[:, 0], h[-1] - h[0]


def seam_share(field: HeightField) -> float:
    """Return the seams' share of the mean-square slope of the tiled surface, 0 to 1.

    The share is about (1/nx + 1/ny)/2 for a patch whose opposite edges meet, and 0 for a flat one.
    """
    seams = seams_of(field)
    slope, inside = (sum(getattr(s, name) for s in seams) for name in ("slope", "slope_inside"))
    return float(slope / (slope + inside)) if slope > 0 else 0.0


def seams_of(field: HeightField) -> tuple[Seam, Seam]:
    """Return the seam between the last and first column, and that between last and first row."""
    dx, dy = field.pixel_size
    return _seam(field.heights.T, dx), _seam(field.heights, dy)


def _seam(h: FloatArray, pixel: float) -> Seam:
    """Return the seam between the last and the first row of `h`, rows `pixel` µm apart."""
    within = np.concatenate(
        [np.mean(np.diff(rows, axis=0) ** 2, axis=1) for rows in blocks(h, 1) if len(rows) > 1]
    )
    across = float(np.mean((h[-1] - h[0]) ** 2))
    lines = h.shape[1] / pixel**2
    return Seam(
        step=math.sqrt(across),
        largest_inside=math.sqrt(float(within.max())),
        rise=float(np.mean(h[-1] - h[0])),
        slope=across * lines,
        slope_inside=float(within.sum()) * lines,
    )
