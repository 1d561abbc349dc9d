"""Files of a surface's BRDF that other programs read: values on a grid, without Mitsuba's plugin.

Lobes and orders narrower than a cell of the grid become as wide as the cell, with the same power.

Contents
--------
nodes    light laid on the nodes of a file
rgl      RGL's tensors (.bsdf), which Mitsuba's BSDF `measured` renders
zemax    tabular BSDF of OpticStudio (.bsdf), one wavelength
scatter  JSON of the BiRD project (.json, .brdf), and long CSV
"""

__all__ = ["rgl", "scatter", "zemax"]
