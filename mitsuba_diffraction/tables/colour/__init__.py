"""The sum over daylight's wavelengths, for RGB variants and shaders.

Contents
--------
table       `ColourTable`; how much colours change from one to another
build       how it is summed, on a polar grid
proposals   densities to draw directions from, by brightness
"""

from .table import ColourTable, cached_colours, colour_difference

__all__ = ["ColourTable", "build", "cached_colours", "colour_difference", "proposals", "table"]
