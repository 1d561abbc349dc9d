"""The thesis of 2014 that the method comes from: its methods, its evaluation, its sweeps.

Contents
--------
methods      ways to spend the wavelength loop, those of the thesis beside the package's own
evaluation   a beam on a patch, and the ridge of maxima
term_images  the look-up of a Taylor series as the thesis stores it
sweeps       one parameter of a BRDF map after the other
"""
