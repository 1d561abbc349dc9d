"""A monochromatic beam on a patch: the ridge of maxima against the grating equation (NumPy only).

Contents
--------
Beam            direction of the light, and the plane of the detector
Response        what a method sends to each viewing angle at each wavelength
measure         a method under a beam
Ridge           viewing angle of the maximum at each wavelength
ridge_of        the ridge of one order
Fit             period of the grating equation that fits a ridge
fit_period      that fit
find_period     period of the strongest ridge that obeys the grating equation, if there is one
window_fits     the same for windows all over the patch
thesis_fit      the procedure behind the thesis' published periods
"""

from __future__ import annotations

from .ridge import Beam, Fit, Response, Ridge, find_period, fit_period, measure, ridge_of
from .windows import thesis_fit, window_fits

#: The name that `thesis_fit` had before.
documents_fit = thesis_fit

__all__ = [
    "Beam", "Fit", "Response", "Ridge", "documents_fit", "find_period", "fit_period", "measure",
    "ridge_of", "thesis_fit", "window_fits",
]  # fmt: skip
