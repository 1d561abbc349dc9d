"""Ways to spend the wavelength loop: those of the thesis beside the package's own.

One interface (`Method`): `brdf` in 1/sr at single wavelengths, `relative` as the thesis defines
reflectance, `xyz` and `linear_srgb` under D65, all for arrays of direction pairs (NumPy only).

Contents
--------
make               a method by name, for a height field
make_all           several of them, which share what they tabulate
NAMES              their names
Method             what each of them is
FullSpectrum       default and flss: uniform sampling of the whole spectrum
OrdersOnly         nmm: only the wavelengths whose orders reach the view direction
Repeated           pq: the patch repeated, with linear or sinc interpolation
Rainbow            rainbow: the grating equation alone
Gain               the thesis' gain factor C
method_map         a method over the hemisphere
estimate_periods   the period of a patch, with its confidence
"""

from __future__ import annotations

from .make import NAMES, make, make_all, method_map
from .method import FullSpectrum, Gain, Method
from .periodic import OrdersOnly, Period, Rainbow, Repeated, estimate_periods

__all__ = [
    "NAMES", "FullSpectrum", "Gain", "Method", "OrdersOnly", "Period", "Rainbow", "Repeated",
    "estimate_periods", "make", "make_all", "method_map",
]  # fmt: skip
