"""Measures of the difference between two pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, uniform_filter

from ...extras import optional
from ...optics.colour import delta_e, encode_srgb
from ...optics.display import LUMINANCE

Image = NDArray[np.floating]

#: Percentiles of ΔE2000 that a comparison reports.
PERCENTILES = (50, 90, 99)


@dataclass(frozen=True)
class Difference:
    """Difference of a picture from its reference.

    Attributes
    ----------
    pixels : number of pixels.
    delta_e_mean, delta_e_percentiles : ΔE2000 as `colour.delta_e` defines it.
    flip : mean of FLIP (Andersson et al. 2020), low dynamic range, at its default viewing distance.
    relative_rmse : ‖difference‖ / ‖reference‖ of linear sRGB.
    """

    pixels: int
    delta_e_mean: float
    delta_e_percentiles: dict[str, float]
    flip: float
    relative_rmse: float


def exposure_of(reference: Image) -> float:
    """Return the factor with which a display clips one pixel in a hundred."""
    white = float(np.percentile(np.asarray(reference, float).max(axis=2), 99.0))
    return 1.0 / white if white > 0.0 else 1.0


def difference(reference: Image, other: Image, exposure: float) -> Difference:
    """Compare a picture (height, width, 3) with its reference.

    Raises a DiffractionError if flip-evaluator is not installed.
    """
    values = delta_e(reference, other, exposure=exposure, least=0.0)
    first, second = (np.asarray(image, float) for image in (reference, other))
    norm = float(np.linalg.norm(first))
    encoded = [encode_srgb(exposure * image).astype(np.float32) for image in (first, second)]
    flips, *_ = optional("flip_evaluator").evaluate(*encoded, "LDR", applyMagma=False)
    return Difference(
        pixels=values.size,
        delta_e_mean=float(values.mean()),
        delta_e_percentiles={str(p): float(np.percentile(values, p)) for p in PERCENTILES},
        flip=float(np.asarray(flips, np.float32).mean()),
        relative_rmse=float(np.linalg.norm(second - first)) / norm if norm > 0.0 else math.nan,
    )


def dark_region(reference: Image, other: Image) -> float:
    """Return the share of the picture of the largest connected region that is darker than half.

    There `other` is less than half as bright as `reference`, both averaged over squares of 3 % of
    the picture's width, against noise.
    """
    side = max(1, round(0.03 * np.shape(reference)[1]))
    first, second = (
        uniform_filter(np.asarray(image, float) @ LUMINANCE, side, mode="nearest")
        for image in (reference, other)
    )
    regions, count = label(second < 0.5 * first)
    return float(np.bincount(regions.ravel(), minlength=2)[1:].max() / first.size) if count else 0.0
