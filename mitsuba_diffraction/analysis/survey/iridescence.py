"""The colours that a surface shows over the hemisphere, and how much they change with direction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..maps import BrdfMap

#: Names of sextants of hue, from red on, each 60° wide in HSV; and of what has next to none.
HUES = ("red", "yellow", "green", "cyan", "blue", "magenta")
#: Saturation below which a colour counts as grey.
GREY = 0.1
# Of the brightest direction's luminance: what is below has no colour to speak of.
_DARK = 1e-9

Reals = NDArray[np.float64]


def iridescence(brdf_map: BrdfMap) -> float:
    """How much colour changes with the view direction.

    The root mean square distance of the chromaticity from its mean, in the CIE 1976 u'v' diagram
    (CIE 15:2018, 8.1), over the hemisphere of view directions (by projected solid angle), weighted
    by luminance Y:

        I = √(Σ Y |c − c̄|² / Σ Y),   c = (u', v'),   c̄ = Σ Y c / Σ Y

    It is 0 for what has one colour in all directions, white or a pigment's, however bright; the
    pure colours of the spectrum between 450 and 650 nm, alike bright, have 0.25. The mirror's lobe
    counts as all other light: colours that gloss outshines are of little weight.
    """
    xyz = _xyz(brdf_map, _seen(brdf_map))
    weight = xyz[:, 1]
    if not weight.sum() > 0.0:
        return 0.0
    chromaticity = _chromaticity(xyz)
    mean = np.average(chromaticity, axis=0, weights=weight)
    squares = np.sum(np.square(chromaticity - mean), axis=1)
    return float(np.sqrt(np.average(squares, weights=weight)))


def colours_of(brdf_map: BrdfMap) -> dict[str, float]:
    """Shares of the luminance away from the mirror's lobe, by hue; they add up to 1, or are all 0.

    Hue is that of linear sRGB, clipped to the display's gamut, in sextants of HSV around the
    primaries and their mixtures; "grey" has a saturation below `GREY`.
    """
    from matplotlib.colors import rgb_to_hsv

    names = (*HUES, "grey")
    away = _seen(brdf_map) & brdf_map.away_from_mirror()
    weight = _xyz(brdf_map, away)[:, 1]
    if not weight.sum() > 0.0:
        return dict.fromkeys(names, 0.0)
    linear = brdf_map.linear[away].astype(np.float64)
    shown = np.clip(linear, 0.0, None)
    brightest = shown.max(axis=1, keepdims=True)
    hsv = rgb_to_hsv(np.divide(shown, brightest, out=np.zeros_like(shown), where=brightest > 0))
    sextant = np.floor(hsv[:, 0] * 6.0 + 0.5).astype(int) % 6
    sextant[hsv[:, 1] < GREY] = 6
    total = np.bincount(sextant, weight, minlength=7)
    return dict(zip(names, (total / total.sum()).tolist(), strict=True))


def _seen(brdf_map: BrdfMap) -> NDArray[np.bool_]:
    lit = brdf_map.luminance > _DARK * brdf_map.luminance.max()
    return np.asarray((brdf_map.coverage > 0.0) & lit)


def _xyz(brdf_map: BrdfMap, directions: NDArray[np.bool_]) -> Reals:
    """X, Y, Z (n, 3) of some directions."""
    if brdf_map.xyz is None:
        raise ValueError("a map of a single wavelength has no colours")
    return np.asarray(brdf_map.xyz[directions], np.float64)


def _chromaticity(xyz: Reals) -> Reals:
    """u', v' of CIE 1976: 4X and 9Y over X + 15Y + 3Z."""
    weights = np.array([1.0, 15.0, 3.0])
    whole = np.maximum(xyz @ weights, 1e-300)
    return np.stack([4.0 * xyz[:, 0] / whole, 9.0 * xyz[:, 1] / whole], axis=-1)
