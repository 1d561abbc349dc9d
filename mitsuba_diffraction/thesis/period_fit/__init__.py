"""Periods of a patch from its response to a monochromatic beam, by the grating equation (NumPy).

Contents
--------
Beam            direction of the light, and the plane of the detector
Response        angle-resolved scatter of a method, by wavelength and viewing angle
measure         response of a method to a beam
Ridge           viewing angle of the maximum at each wavelength
ridge_of        ridge of one order
FEWEST          maxima that a fit needs at least
Fit             period of the grating equation that fits a ridge
fit_period      fit of that period
find_period     period of the strongest ridge that obeys the grating equation, if one does
draw            draw a response and its ridge into Matplotlib axes
window_fits     fits to single coherence windows spread over the patch
thesis_fit      procedure behind the thesis' published periods
"""

from __future__ import annotations

from .plot import draw
from .ridge import (
    FEWEST,
    Beam,
    Fit,
    Response,
    Ridge,
    find_period,
    fit_period,
    measure,
    ridge_of,
)
from .windows import thesis_fit, window_fits

__all__ = [
    "FEWEST", "Beam", "Fit", "Response", "Ridge", "draw", "find_period", "fit_period",
    "measure", "plot", "ridge", "ridge_of", "thesis_fit", "window_fits", "windows",
]  # fmt: skip
