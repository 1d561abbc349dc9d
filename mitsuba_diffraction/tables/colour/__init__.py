"""The sum over daylight's wavelengths, for RGB variants and shaders.

Contents
--------
table               `ColourTable`
build               how it is summed
proposals           densities to draw directions from, by brightness
polar               its grid
colour_difference   how much colours change from one table to another
"""
