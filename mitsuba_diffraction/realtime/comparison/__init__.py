"""How far a realtime picture is from the path-traced one of the same scene.

Contents
--------
Comparison    pictures, sheets, errors and times of both renderers, in a folder
SameLights    a scene for both renderers, under the lights that both know
difference    how far a picture is from its reference, over some of the pixels
Difference    what that gives
delta_e       ΔE2000 of each pixel
exposure_of   the factor that makes a picture's brightest pixels white
"""

from __future__ import annotations

from ...optics.colour import delta_e
from .measures import Difference, difference, exposure_of
from .run import Comparison, SameLights

__all__ = ["Comparison", "Difference", "SameLights", "delta_e", "difference", "exposure_of"]
