"""Random lines: brushed, ground and laser-rippled metal, and the lines of a lathe."""

from __future__ import annotations

import numpy as np

from ..field import HeightField
from ..lengths import Counts, Lengths, count_pair, length_pair, number_between, seed_of
from .noise import grain, rounded


def brushed(
    extent: Lengths = 65.0,
    pixels: Counts = 704,
    seed: int = 0,
    *,
    rms: float = 0.08,
    width: float = 1.0,
    length: float = 15.0,
    period: float | None = None,
) -> HeightField:
    """Generate a Gaussian field of lines along y; with a period, lines that nearly repeat along x.

    Heights are white noise blurred by Gaussians of the widths `width` and `length`. With a period
    two such fields modulate a cosine and a sine along x, which makes a band of spatial frequencies.

    Raises a DiffractionError if a parameter is out of its range.

    Parameters
    ----------
    extent
        Size in µm, one length or (along x, along y), 4 to 500.
    pixels
        Samples, one count or (along x, along y); at least four to `width` and to the period.
    seed
        A whole number; each seed is another piece.
    rms
        Root mean square height, µm.
    width, length
        σ of the blur along x and y, µm: the width of a line, or with a period the distance over
        which lines keep step; and the length of a line.
    period
        Mean distance of lines, µm, adjusted so that whole numbers of them fit; None for no period.
    """
    size = length_pair(extent, "brushed: extent", 4.0, 500.0)
    nx, ny = count_pair(pixels, "brushed: pixels", 8, 8192)
    amplitude = number_between(rms, "brushed: rms", 0.0, 2.0, " µm")
    least = 4.0 * size[0] / nx if period is None else 0.0
    across = number_between(width, "brushed: width", least, size[0] / 4, " µm")
    along = number_between(length, "brushed: length", 0.0, size[1] / 4, " µm")
    rng = np.random.default_rng(seed_of(seed, "brushed: seed"))
    heights = grain(rng, size, (ny, nx), (across, along))
    if period is not None:
        distance = number_between(period, "brushed: period", 4 * size[0] / nx, size[0] / 4, " µm")
        phase = 2 * np.pi * round(size[0] / distance) * np.arange(nx) / nx
        other = grain(rng, size, (ny, nx), (across, along))
        heights = heights * np.cos(phase) + other * np.sin(phase)
    heights = amplitude * (heights - heights.mean())
    return HeightField(rounded(heights), (size[0] / nx, size[1] / ny), name="brushed")
