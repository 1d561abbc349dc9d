"""The thesis of 2014 that the method comes from: its methods, its evaluation, its sweeps.

Contents
--------
methods      ways to spend the wavelength loop, those of the thesis beside the package's own
evaluation   a beam on a patch, and the ridge of maxima
sweeps       one parameter of a BRDF map after the other
"""
