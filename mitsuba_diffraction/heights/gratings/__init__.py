"""Height fields computed from formulas and seeds.

Contents
--------
ideal     gratings with closed-form diffraction
scales    look-alikes of snake scales
fingers   positions and shape of a scale's fingers
noise     periodic random fields
discs     tracks of CDs and DVDs
textures  random lines of brushed and ground metal; rough mirrors with a K-correlation spectrum
"""

from __future__ import annotations

from .discs import cd, dvd
from .ideal import blazed, lamellar, sinusoidal
from .scales import elaphe_like, xenopeltis_like
from .textures import brushed, rough

__all__ = [
    "blazed",
    "brushed",
    "cd",
    "dvd",
    "elaphe_like",
    "lamellar",
    "rough",
    "sinusoidal",
    "xenopeltis_like",
]
