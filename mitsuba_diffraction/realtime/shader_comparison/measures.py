"""Measures of the difference between two pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, label, uniform_filter

from ...extras import optional
from ...optics.colour import delta_e, encode_srgb

Image = NDArray[np.floating]

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB
#: Percentiles of ΔE2000 that a comparison reports.
PERCENTILES = (50, 90, 99)


@dataclass(frozen=True)
class Difference:
    """Difference of a picture from its reference, over some of the pixels.

    Attributes
    ----------
    pixels : number of these pixels.
    share : their share of the picture.
    delta_e_mean, delta_e_percentiles : ΔE2000 as `colour.delta_e` defines it; NaN without pixels.
    flip : mean of FLIP (Andersson et al. 2020), low dynamic range, at its default viewing distance.
    relative_rmse : ‖difference‖ / ‖reference‖ of linear sRGB.
    """

    pixels: int
    share: float
    delta_e_mean: float
    delta_e_percentiles: dict[str, float]
    flip: float
    relative_rmse: float


def exposure_of(reference: Image) -> float:
    """Return the factor with which a display clips one pixel in a hundred."""
    white = float(np.percentile(np.asarray(reference, float).max(axis=2), 99.0))
    return 1.0 / white if white > 0.0 else 1.0


def difference(
    reference: Image, other: Image, mask: NDArray[np.bool_] | None, exposure: float
) -> Difference:
    """Compare a picture (height, width, 3) with its reference, over all pixels or a mask.

    With a mask, nearly black pixels do not count for ΔE2000. FLIP's filters reach neighbouring
    pixels: outside the mask, both pictures are assumed to be equal.

    Raises a DiffractionError if flip-evaluator is not installed.
    """
    least = 0.01 if mask is not None else 0.0
    if mask is None:
        mask = np.ones(np.shape(reference)[:2], bool)
    values = delta_e(reference, other, exposure=exposure, least=least)[mask]
    values = values[np.isfinite(values)]
    first, second = (np.asarray(image, float)[mask] for image in (reference, other))
    norm = float(np.linalg.norm(first))
    flip = math.nan
    if mask.any():
        inside = np.where(mask[..., None], other, reference)
        encoded = [
            encode_srgb(exposure * np.asarray(a, float)).astype(np.float32)
            for a in (reference, inside)
        ]
        flips, *_ = optional("flip_evaluator").evaluate(*encoded, "LDR", applyMagma=False)
        flip = float(np.asarray(flips, np.float32).reshape(mask.shape)[mask].mean())
    return Difference(
        pixels=int(mask.sum()),
        share=float(mask.mean()),
        delta_e_mean=float(values.mean()) if values.size else math.nan,
        delta_e_percentiles={
            str(p): float(np.percentile(values, p)) if values.size else math.nan
            for p in PERCENTILES
        },
        flip=flip,
        relative_rmse=float(np.linalg.norm(second - first)) / norm if norm > 0.0 else math.nan,
    )


def dark_region(reference: Image, other: Image) -> float:
    """Return the share of the picture of the largest connected region that is darker than half.

    There `other` is less than half as bright as `reference`, both averaged over squares of 3 % of
    the picture's width, against noise.
    """
    side = max(1, round(0.03 * np.shape(reference)[1]))
    first, second = (
        uniform_filter(np.asarray(image, float) @ _LUMINANCE, side, mode="nearest")
        for image in (reference, other)
    )
    regions, count = label(second < 0.5 * first)
    return float(np.bincount(regions.ravel(), minlength=2)[1:].max() / first.size) if count else 0.0


class Visibility(NamedTuple):
    """Shape and light of each pixel of a scene, (height, width)."""

    # index among the scene's shapes, −1 for the background, −2 where rays in the pixel differ
    shape: NDArray[np.int64]
    # whether no ray in the pixel is in shadow, and at least one light is above the surface
    lit: NDArray[np.bool_]


def regions(
    visibility: Visibility,
    exact: NDArray[np.bool_],
    diffracting: NDArray[np.bool_],
    coverage: NDArray[np.floating],
) -> dict[str, NDArray[np.bool_]]:
    """Classify pixels; each class excludes one-pixel edges.

    Parameters
    ----------
    visibility : result of `path_traced.visibility`.
    exact, diffracting : for each shape of the scene, whether the shaders support all of its
        material, and whether it diffracts.
    coverage : coverage of the realtime picture, 0 to 1.

    Returns
    -------
    both : pixels that both renderers show and light; they are compared.
    diffracting : pixels of `both` that diffract.
    shadow : pixels that only the realtime picture lights.
    other : shapes whose materials differ, and pixels that only one renderer covers.
    edge : all other pixels.
    """
    shape, lit = visibility
    whole = (shape >= 0) & (coverage > 0.999)
    index = np.maximum(shape, 0)
    supported = whole & exact[index]
    same = np.ones_like(whole)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        neighbour = np.roll(shape, (dy, dx), axis=(0, 1)) == shape
        same &= neighbour & np.roll(neighbour, (-dy, -dx), axis=(0, 1))
    both = binary_erosion(supported & lit, np.ones((3, 3)), border_value=1) & same
    shadow = supported & ~lit
    other = ((shape >= 0) & ~supported) | ((shape == -1) & (coverage > 0.0))
    background = (shape == -1) & (coverage == 0.0)
    return {
        "both": both,
        "diffracting": both & diffracting[index],
        "shadow": shadow,
        "other": other,
        "edge": ~(both | shadow | other | background),
    }
