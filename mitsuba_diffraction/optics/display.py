"""Display transform: linear sRGB to the values of a screen, by one of two views (NumPy only).

`standard` clips each channel by itself. Bright or saturated light then ends in flat bands of six
colours. `natural` keeps the order of hues and turns what is bright to white:

1. In Rec. 2020, a colour outside the gamut moves towards grey of its luminance until no channel is
   negative. This line keeps the dominant wavelength.
2. AgX (T. Sobotka 2022, github.com/sobotka/AgX, in the Rec. 2020 form of Blender 4 and Filament,
   google/filament pull request 7236): a matrix that moves the primaries inwards, a logarithm over
   16.5 stops, a sigmoid, and a matrix that moves the primaries outwards again.
3. In sRGB, a colour outside the display's range moves towards grey of its luminance as in step 1.

A reflectance of 0.18 keeps its brightness. `realtime/glsl/shaders/display.glsl` is the twin for
shaders and gets its constants from `constants`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from .colour import encode_srgb

Array = NDArray[np.float64]

#: Ways to show linear light.
VIEWS = ("natural", "standard")

# BT.2087: linear sRGB to linear Rec. 2020; rows of both sum to 1
_TO_WIDE = np.array(
    [
        [0.6274038959, 0.3292830384, 0.0433130657],
        [0.0690972894, 0.9195403951, 0.0113623156],
        [0.0163914389, 0.0880133079, 0.8955952532],
    ]
)
_INSET = np.array(
    [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ]
)
_OUTSET = np.array(
    [
        [1.1271005818144368, -0.11060664309660323, -0.016493938717834573],
        [-0.1413297634984383, 1.157823702216272, -0.016493938717834257],
        [-0.14132976349843826, -0.11060664309660294, 1.2519364065950405],
    ]
)
# luminance of linear Rec. 2020 (BT.2020) and of linear sRGB (IEC 61966-2-1)
_WIDE_LUMINANCE, _LUMINANCE = np.array([0.2627, 0.6780, 0.0593]), np.array([0.2126, 0.7152, 0.0722])

_GREY = 0.18  # reflectance that keeps its brightness
_BELOW, _STOPS = 10.0, 16.5  # stops of the logarithm below grey, and in all
_GAMMA = 2.2  # the sigmoid's values are linear light to the power of 1 / _GAMMA
# slope at grey, more than AgX's own 2.0, whose pictures look pale; powers of toe and shoulder: a
# soft toe keeps shadows, a harder shoulder keeps white paper bright
_SLOPE, _TOE, _SHOULDER = 2.4, 1.5, 2.5

_PIVOT = (_BELOW / _STOPS, _GREY ** (1.0 / _GAMMA))
_DARKEST = _GREY * 2.0**-_BELOW


def shown(linear: ArrayLike, view: str = "natural") -> Array:
    """Encode linear sRGB (..., 3), where 1 is white, for a display: 0 to 1, sRGB's transfer curve.

    Raises a DiffractionError if `view` is none of `VIEWS`.
    """
    check_view(view)
    return encode_srgb(linear if view == "standard" else natural(linear))


def check_view(view: str) -> None:
    """Raise a DiffractionError if `view` is none of `VIEWS`."""
    if view not in VIEWS:
        raise DiffractionError(f"view={view!r} is unknown; choose one of {', '.join(VIEWS)}")


def natural(linear: ArrayLike) -> Array:
    """Return linear sRGB (..., 3), any values, within the display's range: 0 to 1, still linear."""
    light = np.asarray(linear, np.float64)
    wide = _fitted(light @ _TO_WIDE.T, _WIDE_LUMINANCE, np.inf)
    stops = np.log2(np.maximum(wide @ _INSET.T, _DARKEST) / _GREY)
    curved = _sigmoid(np.clip((stops + _BELOW) / _STOPS, 0.0, 1.0))
    wide = np.maximum(curved @ _OUTSET.T, 0.0) ** _GAMMA
    return _fitted(wide @ np.linalg.inv(_TO_WIDE).T, _LUMINANCE, 1.0)


def constants() -> dict[str, float | Array]:
    """Return the constants that the shader's twin needs, by name; matrices multiply columns."""
    low, high = _reaches()
    return {
        "TO_WIDE": _TO_WIDE, "FROM_WIDE": np.linalg.inv(_TO_WIDE),
        "INSET": _INSET, "OUTSET": _OUTSET,
        "WIDE_LUMINANCE": _WIDE_LUMINANCE, "LUMINANCE": _LUMINANCE,
        "GREY": _GREY, "BELOW": _BELOW, "STOPS": _STOPS, "GAMMA": _GAMMA, "DARKEST": _DARKEST,
        "PIVOT": np.array(_PIVOT), "SLOPE": _SLOPE,
        "TOE": np.array([_TOE, low]), "SHOULDER": np.array([_SHOULDER, high]),
    }  # fmt: skip


def _fitted(light: Array, luminance: Array, most: float) -> Array:
    """Move colours (..., 3) towards grey of their luminance until all channels are 0 to `most`."""
    grey = np.clip(light @ luminance, 0.0, most)[..., None]
    away = light - grey
    # 1e-30: no colour, no limit
    below = grey / np.maximum(-away.min(axis=-1, keepdims=True), 1e-30)
    above = (most - grey) / np.maximum(away.max(axis=-1, keepdims=True), 1e-30)
    return np.clip(grey + np.minimum(1.0, np.minimum(below, above)) * away, 0.0, most)


def _sigmoid(x: Array) -> Array:
    """Return AgX's curve from (0, 0) to (1, 1), of slope `_SLOPE` at its pivot."""
    away = _SLOPE * np.abs(x - _PIVOT[0])
    low, high = _reaches()
    under = _PIVOT[1] - away / (1.0 + (away / low) ** _TOE) ** (1.0 / _TOE)
    over = _PIVOT[1] + away / (1.0 + (away / high) ** _SHOULDER) ** (1.0 / _SHOULDER)
    return np.where(x < _PIVOT[0], np.maximum(under, 0.0), np.minimum(over, 1.0))


def _reaches() -> tuple[float, float]:
    """Return the scales of toe and shoulder."""
    rest = 1.0 - _PIVOT[0], 1.0 - _PIVOT[1]
    return _reach(*_PIVOT, _TOE), _reach(*rest, _SHOULDER)


def _reach(run: float, rise: float, power: float) -> float:
    """Return the scale with which a half of the curve rises by `rise` over `run`."""
    slope = _SLOPE * run
    return float((slope**-power * ((slope / rise) ** power - 1.0)) ** (-1.0 / power))
