"""What becomes of one order's light: the factor of |a_j|² in the albedo (NumPy, float64).

An order of a surface sends the share η = G |a_j|² of the light along −ωi to ωo, with

    G = 4 cosθi cosθo N / w²,

N the mean power of the boundary's Jones matrix (`optics.boundary`): for Kirchhoff's and R = 1 it is
(1 + ωi·ωo)²/(w² cosθi cosθo). G is symmetric in ωi and ωo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from ...optics import blend, boundary, fresnel
from ..table import DiffractionTable

Real = NDArray[np.float64]

#: Polar angles of both directions and azimuths between them at which G is computed.
POLAR_NODES, AZIMUTH_NODES = 31, 15
#: Polar angles θo and cosines of the azimuth between which its table is then bilinear.
POLAR_FINE, AZIMUTH_FINE = 61, 65
# The horizon itself would divide by zero in the facets' frame
_LEAST_COSINE = 1e-3


@dataclass(frozen=True)
class Gain:
    """G of one model, material and wavelength.

    Attributes
    ----------
    table : whose roughness the small-slope model follows.
    model : "kirchhoff" or "small_slope".
    index : n + ik over that of the medium above; None for R = 1.
    wavenumber : 2π/λ, rad/µm.
    height_scale : factor on the table's heights.
    """

    table: DiffractionTable
    model: str
    index: complex | None
    wavenumber: float
    height_scale: float

    def ratio(self, cos_i: ArrayLike, x: Real, y: Real, cos_o: Real) -> Real:
        """G over that of Kirchhoff's with R = 1: finite, and smooth up to the horizon.

        ωi lies in the plane y = 0, towards +x; (x, y, cos_o) is ωo. All broadcast.
        """
        cos_i, x, y, cos_o = np.broadcast_arrays(cos_i, x, y, cos_o)
        if self.index is None:
            return np.ones_like(cos_o)
        sin_i, w = np.sqrt(1.0 - cos_i**2), cos_i + cos_o
        # |ωi + ωo|² = 2(1 + ωi·ωo)
        one_plus_dot = 0.5 * ((x + sin_i) ** 2 + y**2 + w**2)
        if self.model == "kirchhoff":
            return fresnel.reflectance(np.sqrt(np.minimum(0.5 * one_plus_dot, 1.0)), self.index)
        wi = np.stack([sin_i, np.zeros_like(sin_i), cos_i], axis=-1)
        wo = np.stack([x, y, cos_o], axis=-1)
        variance = self.table.roughness.at(self.wavenumber * np.hypot(x + sin_i, y))
        s = blend.weight(self.wavenumber * w * self.height_scale, variance, self.index)
        power = boundary.unpolarised(blend.jones(wi, wo, self.index, s))
        return np.asarray((2.0 * cos_i * cos_o / one_plus_dot) ** 2 * power)

    def tables(self, theta: Real) -> Real:
        """`ratio` at θi = theta (t,), rad, for `read`: (t, POLAR_FINE, AZIMUTH_FINE)."""
        nodes = np.linspace(0.0, 0.5 * np.pi, POLAR_NODES)
        cosines = np.maximum(np.cos(nodes), _LEAST_COSINE)
        turns = np.polynomial.chebyshev.chebpts2(AZIMUTH_NODES)  # cos(φo − φi)
        sines = np.sqrt(1.0 - cosines**2)[:, None]
        values = self.ratio(
            cosines[:, None, None], sines * turns, sines * np.sqrt(1.0 - turns**2), cosines[:, None]
        )
        # nearly a polynomial in cos(φo − φi), and smooth in the polar angles
        across = np.polynomial.chebyshev.chebvander(turns, AZIMUTH_NODES - 1)
        fine = np.polynomial.chebyshev.chebvander(
            np.linspace(-1.0, 1.0, AZIMUTH_FINE), AZIMUTH_NODES - 1
        )
        values = values @ (fine @ np.linalg.inv(across)).T
        values = CubicSpline(nodes, values, axis=1)(np.linspace(0.0, 0.5 * np.pi, POLAR_FINE))
        return np.asarray(CubicSpline(nodes, values, axis=0)(theta))


def read(table: Real, cos_o: Real, turn: Real) -> Real:
    """One θi's table at (cosθo, φo − φi), bilinear."""
    row = np.arccos(np.minimum(cos_o, 1.0)) * ((POLAR_FINE - 1) / (0.5 * np.pi))
    column = (np.cos(turn) + 1.0) * (0.5 * (AZIMUTH_FINE - 1))
    i = np.clip(row.astype(np.int32), 0, POLAR_FINE - 2)
    j = np.clip(column.astype(np.int32), 0, AZIMUTH_FINE - 2)
    s, t = row - i, column - j
    flat, index = table.ravel(), i * AZIMUTH_FINE + j
    low = flat.take(index) * (1.0 - t) + flat.take(index + 1) * t
    index = index + AZIMUTH_FINE
    return np.asarray(
        low * (1.0 - s) + (flat.take(index) * (1.0 - t) + flat.take(index + 1) * t) * s
    )


#: cosθ of `fade`: light that leaves or comes within 10° of the horizon.
GRAZING = float(np.cos(np.radians(80.0)))


def fade(cos_i: ArrayLike, cos_o: ArrayLike) -> Real:
    """(min/max)² of the two cosines, those above cos 80° taken for cos 80°: symmetric.

    Kirchhoff's G grows as 1/cosθo towards the horizon: an order that comes up there is a spike of
    the albedo as narrow as the coherence window's lobe. So it comes up gently, and what is taken
    from light between the horizon and 10° above the other directions get back (`conservation`).
    Mirrors, and all light that comes and leaves within 80° of the normal, are left as they are.
    """
    one, other = np.minimum(cos_i, GRAZING), np.minimum(cos_o, GRAZING)
    return np.asarray((np.minimum(one, other) / np.maximum(one, other)) ** 2)
