"""Files of a surface's BRDF that other programs read: values on a grid, without Mitsuba's plugin.

Lobes and orders narrower than a cell of the grid become as wide as the cell, with the same power.

Contents
--------
cells    means of the BRDF over cells of directions
rgl      RGL's tensors (.bsdf), which Mitsuba's BSDF `measured` renders
zemax    tabular BSDF of OpticStudio (.bsdf), one wavelength
bird     JSON of the BiRD project (.json, .brdf)
"""
