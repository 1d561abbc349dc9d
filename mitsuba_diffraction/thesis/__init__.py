"""Methods and experiments of the 2014 thesis that the package's model is based on.

Contents
--------
methods      the thesis' methods to sum over wavelengths, and the package's own
period_fit   period of the grating equation that fits the response of a patch to a beam
term_images  look-up of a Taylor series as the thesis stores it
shaders      the methods for the realtime renderer
sweeps       BRDF maps for several values of one parameter, compared and timed
"""

__all__ = ["sweeps", "term_images"]
