"""Numbers for the difference between two pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from ...errors import DiffractionError
from ...optics.colour import delta_e, encode_srgb

Image = NDArray[np.floating]

#: Percentiles of ΔE2000 that are given.
PERCENTILES = (50, 90, 99)


@dataclass(frozen=True)
class Difference:
    """How far a picture is from its reference, over some of the pixels.

    Attributes
    ----------
    pixels : how many.
    share : of the picture.
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
    """The factor with which a display clips one pixel in a hundred, and no more."""
    white = float(np.percentile(np.asarray(reference, float).max(axis=2), 99.0))
    return 1.0 / white if white > 0.0 else 1.0


def flip_map(reference: Image, other: Image, exposure: float) -> NDArray[np.float32]:
    """FLIP's error, 0 to 1, (height, width).

    Parameters
    ----------
    reference, other : (height, width, 3) linear sRGB.
    exposure : what both are multiplied with.

    Raises
    ------
    DiffractionError
        If flip-evaluator is not installed.
    """
    try:
        import flip_evaluator
    except ImportError as error:
        raise DiffractionError(
            "FLIP needs flip-evaluator: pip install 'mitsuba-diffraction[gl]'"
        ) from error
    shown = [
        encode_srgb(exposure * np.asarray(a, float)).astype(np.float32) for a in (reference, other)
    ]
    found, _, _ = flip_evaluator.evaluate(*shown, "LDR", applyMagma=False)
    return np.asarray(found, np.float32).reshape(shown[0].shape[:2])


def difference(
    reference: Image, other: Image, mask: NDArray[np.bool_] | None, exposure: float
) -> Difference:
    """How far a picture (height, width, 3) is from its reference over all pixels, or some.

    Of some, those that are nearly black do not count for ΔE2000. FLIP's filters reach into
    neighbours: those outside the mask are taken to be alike.
    """
    least = 0.01 if mask is not None else 0.0
    if mask is None:
        mask = np.ones(np.shape(reference)[:2], bool)
    values = delta_e(reference, other, exposure=exposure, least=least)[mask]
    values = values[np.isfinite(values)]
    first, second = (np.asarray(image, float)[mask] for image in (reference, other))
    norm = float(np.linalg.norm(first))
    nothing = math.nan
    flip = nothing
    if mask.any():
        inside = np.where(mask[..., None], other, reference)
        flip = float(flip_map(reference, inside, exposure)[mask].mean())
    return Difference(
        pixels=int(mask.sum()),
        share=float(mask.mean()),
        delta_e_mean=float(values.mean()) if values.size else nothing,
        delta_e_percentiles={
            str(p): float(np.percentile(values, p)) if values.size else nothing for p in PERCENTILES
        },
        flip=flip,
        relative_rmse=float(np.linalg.norm(second - first)) / norm if norm > 0.0 else nothing,
    )


def regions(
    seen: dict[str, NDArray[Any]],
    exact: NDArray[np.bool_],
    diffracting: NDArray[np.bool_],
    coverage: NDArray[np.floating],
) -> dict[str, NDArray[np.bool_]]:
    """Kinds of pixels, each without the one-pixel edges of what it consists of.

    Parameters
    ----------
    seen : of `truth.seen`.
    exact, diffracting : of each shape of its scene, whether all of its material is shown, and
        whether it diffracts.
    coverage : of the realtime picture, 0 to 1.

    Returns
    -------
    both : seen by both renderers and lit in both: what is compared.
    diffracting : those of them that diffract.
    shadow : lit in the realtime picture only.
    other : shapes whose materials are shown otherwise, and where one of the two sees nothing.
    edge : the rest.
    """
    shape, lit = seen["shape"], seen["lit"]
    whole = (shape >= 0) & (coverage > 0.999)
    index = np.maximum(shape, 0)
    shown = whole & exact[index]
    same = np.ones_like(whole)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        neighbour = np.roll(shape, (dy, dx), axis=(0, 1)) == shape
        same &= neighbour & np.roll(neighbour, (-dy, -dx), axis=(0, 1))
    both = binary_erosion(shown & lit, np.ones((3, 3)), border_value=1) & same
    shadow = shown & ~lit
    other = ((shape >= 0) & ~shown) | ((shape == -1) & (coverage > 0.0))
    background = (shape == -1) & (coverage == 0.0)
    return {
        "both": both,
        "diffracting": both & diffracting[index],
        "shadow": shadow,
        "other": other,
        "edge": ~(both | shadow | other | background),
    }
