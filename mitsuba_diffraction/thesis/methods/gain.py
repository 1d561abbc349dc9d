"""Relative reflectance, as the thesis defines it (NumPy only).

It divides the reflected radiance by that of a flat mirror of the same material lit and seen along
the normal. With S(ωi, ωo; λ) = ⟨|P|²⟩ under the window, normalised to 1 for that mirror, what is
left of the BRDF (Stam 1999, eq. 7) is

    ρ(λ) = C(ωi, ωo)·S,   C = F²(ωi, ωo)/F²(ω0, ω0) · (1 + ωi·ωo)²/(w² cosθo) · G,

with w = cosθi + cosθo and Schlick's F. So ρ has neither 1/λ² nor the window's area: in it blue is
weaker against red, by up to (λ_blue/λ_red)², than in the BRDF f(λ) = (1 + ωi·ωo)² 4πσ²·S /
(λ² w² cosθi cosθo). The thesis wrote F², although Schlick's F already is a power, and
always multiplied by the shadowing G of V-shaped grooves: both are kept here, since that is what
makes their pictures; the BRDF proper has neither.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError

SHADOWINGS = ("none", "vcavity")


@dataclass(frozen=True)
class Gain:
    """The gain factor C.

    Parameters
    ----------
    int_ior : index of refraction of the material against air, above 1; 1.5 for shed snake skin.
    shadowing : "vcavity", as in the thesis, or "none".

    Raises
    ------
    DiffractionError
        If a parameter is out of range.
    """

    int_ior: float = 1.5
    shadowing: str = "vcavity"

    def __post_init__(self) -> None:
        if not 1.0 < self.int_ior < 100.0:
            raise DiffractionError(
                f"int_ior={self.int_ior:g} must be above 1 and below 100 for relative reflectance: "
                "it is relative to a mirror of that index"
            )
        if self.shadowing not in SHADOWINGS:
            raise DiffractionError(
                f"shadowing='{self.shadowing}' is unknown; choose one of {', '.join(SHADOWINGS)}"
            )

    def factor(self, wi: NDArray[np.float64], wo: NDArray[np.float64]) -> NDArray[np.float64]:
        """C, dimensionless, shape (n,), for unit vectors (n, 3); 0 below the surface.

        G = min(1, 2(n·h)(n·ωi)/(ωo·h), 2(n·h)(n·ωo)/(ωo·h)) (Blinn 1977; Stam 1999, appendix), and
        F = F0 + (1 − F0)(1 − h·ωo)⁵ with F0 = ((n − 1)/(n + 1))² (Schlick 1994).
        """
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        cos_i, cos_o = (np.where(above, d[:, 2], 1.0) for d in (wi, wo))
        w = cos_i + cos_o
        length = np.sqrt(np.sum((wi + wo)[:, :2] ** 2, axis=1) + w * w)  # |ωi + ωo| = 2 h·ωo
        one_plus_dot = 0.5 * length**2
        f0 = ((self.int_ior - 1.0) / (self.int_ior + 1.0)) ** 2
        fresnel = f0 + (1.0 - f0) * (1.0 - np.minimum(0.5 * length, 1.0)) ** 5
        gain = (fresnel / f0) ** 2 * one_plus_dot**2 / (w * w * cos_o)
        if self.shadowing == "vcavity":
            gain *= np.minimum(1.0, 2.0 * w * np.minimum(cos_i, cos_o) / one_plus_dot)
        return np.where(above, gain, 0.0)
