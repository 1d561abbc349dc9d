"""Methods to sum the BRDF over wavelengths: the methods of the thesis and the package's default.

All have one interface (`Method`): `brdf` in 1/sr at single wavelengths, `relative` as the thesis
defines reflectance, `xyz` and `linear_srgb` under D65, for arrays of direction pairs (NumPy only).

Contents
--------
make               build a method by name, for a height field
make_all           build several methods, which share tables
NAMES              names of the methods
Method             interface of all methods
FullSpectrum       default and flss: uniform sampling of the whole spectrum
OrdersOnly         nmm: only the wavelengths whose orders reach the view direction
Repeated           pq: the patch repeated, with linear or sinc interpolation
Rainbow            rainbow: the grating equation alone
Gain               the thesis' gain factor C
method_map         evaluate a method over the hemisphere
estimate_periods   periods of a patch along x and y, with their confidence
"""

from __future__ import annotations

from .make import NAMES, make, make_all, method_map
from .method import FullSpectrum, Gain, Method
from .periodic import OrdersOnly, Rainbow, Repeated
from .periods import Period, estimate_periods

__all__ = [
    "NAMES", "FullSpectrum", "Gain", "Method", "OrdersOnly", "Period", "Rainbow", "Repeated",
    "estimate_periods", "make", "make_all", "method", "method_map", "periods",
]  # fmt: skip
