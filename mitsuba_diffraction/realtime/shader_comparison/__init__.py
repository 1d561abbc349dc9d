"""Comparison of realtime pictures with path-traced pictures of the same scene.

Contents
--------
Comparison    pictures, sheets, errors and times of both renderers, in a folder
difference    compare a picture with its reference
Difference    measures of that comparison
delta_e       ΔE2000 of each pixel
exposure_of   factor with which a picture's brightest pixels are white
"""

from __future__ import annotations

from ...optics.colour import delta_e
from .measures import Difference, difference, exposure_of
from .run import Comparison

__all__ = ["Comparison", "Difference", "delta_e", "difference", "exposure_of"]
