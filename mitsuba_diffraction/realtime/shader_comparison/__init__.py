"""Comparison of realtime pictures with path-traced pictures of the same scene.

Contents
--------
Comparison    pictures, sheets, errors and times of both renderers, in a folder
difference    compare a picture with its reference
Difference    measures of that comparison
delta_e       ΔE2000 of each pixel
exposure_of   factor with which a picture's brightest pixels are white
plain_number  format a number as reports of comparisons do
"""

from __future__ import annotations

from ...optics.colour import delta_e
from .measures import Difference, difference, exposure_of
from .report import plain_number
from .run import Comparison

__all__ = [
    "Comparison", "Difference", "delta_e", "difference", "exposure_of", "plain_number",
    "report", "run",
]  # fmt: skip
