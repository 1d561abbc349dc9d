"""Height fields that are made, not measured.

`ideal`: gratings with closed-form diffraction, for checks. `scales`: look-alikes of snake scales.
`discs`: the tracks of CDs and DVDs.
"""

from __future__ import annotations

from .discs import cd, dvd
from .ideal import blazed, lamellar, sinusoidal
from .scales import elaphe_like, xenopeltis_like

__all__ = ["blazed", "cd", "dvd", "elaphe_like", "lamellar", "sinusoidal", "xenopeltis_like"]
