"""BRDF maps: pictures of the hemisphere of view directions for one direction to the light.

Contents
--------
brdf_map        evaluate a BSDF over the hemisphere
check_map       check the parameters of `brdf_map` before any work
check_variant   check the current variant likewise
BrdfMap         colours and spectra of a map
LightDirection  direction to the light
Bands           bands of wavelengths to sum over
contact_sheet   draw several maps as one figure
draw            draw a map into Matplotlib axes
save_png        write a map as a picture with axes
save_exr        write a map as linear numbers
"""

from __future__ import annotations

from .evaluate import brdf_map, check_map, check_variant
from .picture import contact_sheet, draw, save_exr, save_png
from .result import Bands, BrdfMap, LightDirection

__all__ = [
    "Bands", "BrdfMap", "LightDirection", "brdf_map", "check_map", "check_variant",
    "contact_sheet", "draw", "hemisphere", "picture", "result", "save_exr", "save_png",
]  # fmt: skip
