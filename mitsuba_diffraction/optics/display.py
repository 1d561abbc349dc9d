"""Display transform: linear sRGB to the values of a screen, by one of two views (NumPy only).

`standard` clips each channel by itself. Bright or saturated light then ends in flat bands of six
colours. `natural` keeps the order of hues and turns bright light white:

1. In Rec. 2020, a colour outside the gamut moves towards grey of its luminance until no channel is
   negative. This line keeps the dominant wavelength.
2. AgX (T. Sobotka 2022, github.com/sobotka/AgX, in the Rec. 2020 form of Blender 4 and Filament,
   google/filament pull request 7236): a matrix that moves the primaries inwards, a logarithm over
   16.5 stops, a sigmoid, and a matrix that moves the primaries outwards again.
3. In sRGB, a colour outside the display's range moves towards grey of its luminance as in step 1.

A reflectance of 0.18 keeps its brightness. Shaders have the functions from here (`programs`).
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from ..errors import check_choice
from .arithmetic import Number, of
from .colour import encode_srgb, encoded_colour

Colour = tuple[Number, Number, Number]

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
_FROM_WIDE = np.linalg.inv(_TO_WIDE)
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
#: Luminance of linear Rec. 2020 (BT.2020) and of linear sRGB (IEC 61966-2-1)
_WIDE_LUMINANCE, LUMINANCE = (0.2627, 0.6780, 0.0593), (0.2126, 0.7152, 0.0722)

_GREY = 0.18  # reflectance that keeps its brightness
_BELOW, _STOPS = 10.0, 16.5  # stops of the logarithm below grey, and in all
_GAMMA = 2.2  # the sigmoid's values are linear light to the power of 1 / _GAMMA
# slope at grey, more than AgX's own 2.0, whose pictures look pale; powers of toe and shoulder: a
# soft toe keeps shadows, a harder shoulder keeps white paper bright
_SLOPE, _TOE, _SHOULDER = 2.4, 1.5, 2.5

_PIVOT = (_BELOW / _STOPS, _GREY ** (1.0 / _GAMMA))
_DARKEST = _GREY * 2.0**-_BELOW
# times an entry of a matrix it is far from the largest number of single precision
_MOST = 1e20


def shown(linear: ArrayLike, view: str = "natural") -> Real:
    """Encode linear sRGB (..., 3), where 1 is white, for a display: 0 to 1, sRGB's transfer curve.

    Raises a DiffractionError if `view` is not in `VIEWS`.
    """
    check_choice("view", view, VIEWS)
    return encode_srgb(linear if view == "standard" else natural(linear))


def natural(linear: ArrayLike) -> Real:
    """Return linear sRGB (..., 3), any values, within the display's range: 0 to 1, still linear."""
    light = np.asarray(linear, np.float64)
    return np.stack(natural_colour((light[..., 0], light[..., 1], light[..., 2])), axis=-1)


def shown_colour(linear: Colour) -> Colour:
    """Encode linear sRGB, where 1 is white, for a display by the view `natural`."""
    return encoded_colour(natural_colour(linear))


def natural_colour(linear: Colour) -> Colour:
    """Return linear sRGB within the display's range by the view `natural`, still linear."""
    xp = of(*linear)
    red, green, blue = (xp.clip(channel, -_MOST, _MOST) for channel in linear)
    wide = fitted_colour(_product(_TO_WIDE, (red, green, blue)), _WIDE_LUMINANCE, _MOST)
    red, green, blue = (
        (xp.log2(xp.maximum(c, _DARKEST) * (1.0 / _GREY)) + _BELOW) * (1.0 / _STOPS)
        for c in _product(_INSET, wide)
    )
    curved = display_curve(red), display_curve(green), display_curve(blue)
    red, green, blue = (xp.power(xp.maximum(c, 0.0), _GAMMA) for c in _product(_OUTSET, curved))
    return fitted_colour(_product(_FROM_WIDE, (red, green, blue)), LUMINANCE, 1.0)


def fitted_colour(light: Colour, luminance: Colour, most: Number) -> Colour:
    """Move a colour towards grey of its luminance until all channels are 0 to `most`."""
    xp = of(*light)
    grey = xp.clip(sum(x * w for x, w in zip(light, luminance, strict=True)), 0.0, most)
    away = light[0] - grey, light[1] - grey, light[2] - grey
    # 1e-30: no colour, no limit
    below = grey * xp.reciprocal(xp.maximum(-reduce(xp.minimum, away), 1e-30))
    above = (most - grey) * xp.reciprocal(xp.maximum(reduce(xp.maximum, away), 1e-30))
    share = xp.minimum(1.0, xp.minimum(below, above))
    red, green, blue = (xp.clip(grey + share * part, 0.0, most) for part in away)
    return red, green, blue


def display_curve(stops: Number) -> Number:
    """Return AgX's curve from (0, 0) to (1, 1), of a fixed slope at its pivot."""
    xp = of(stops)
    x = xp.clip(stops, 0.0, 1.0)
    away = _SLOPE * xp.absolute(x - _PIVOT[0])
    low, high = _reaches()
    dark = x < _PIVOT[0]
    power, scale = xp.where(dark, _TOE, _SHOULDER), xp.where(dark, low, high)
    bent = xp.power(xp.power(away / scale, power) + 1.0, 1.0 / power)
    change = away / bent
    return xp.clip(xp.where(dark, _PIVOT[1] - change, _PIVOT[1] + change), 0.0, 1.0)


def _product(matrix: Real, colour: Colour) -> Colour:
    red, green, blue = (
        sum(float(m) * x for m, x in zip(row, colour, strict=True)) for row in matrix
    )
    return red, green, blue


def _reaches() -> tuple[float, float]:
    """Return the scales of toe and shoulder."""
    rest = 1.0 - _PIVOT[0], 1.0 - _PIVOT[1]
    return _reach(*_PIVOT, _TOE), _reach(*rest, _SHOULDER)


def _reach(run: float, rise: float, power: float) -> float:
    """Return the scale with which a half of the curve rises by `rise` over `run`."""
    slope = _SLOPE * run
    return float((slope**-power * ((slope / rise) ** power - 1.0)) ** (-1.0 / power))
